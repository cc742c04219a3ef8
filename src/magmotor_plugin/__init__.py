"""The engine plugins, which make magnetism a part of a MuJoCo model.

`magmotor.forces` computes forces, `magmotor.magnetometer` is a sensor. MuJoCo 4 and newer call
`register` whenever `mujoco` is imported, through the entry point group `mujoco.plugins`; `import
magmotor` calls it, too. It compiles nothing and imports only the standard library. The compiled
code of a plugin takes its place in MuJoCo's table when the first model with that plugin is
compiled.
"""

import sys
from types import ModuleType

from magmotor_plugin import slots
from magmotor_plugin.library import loads_entry_points
from magmotor_plugin.slots import register


def _callbacks() -> ModuleType:
    from magmotor.mjcf import callbacks

    return callbacks


slots.callbacks = _callbacks


def register_with_older_mujoco() -> None:
    """Register the plugin if `mujoco` has been imported, or would not load entry points.

    MuJoCo numbers plugins in the order of their registration, and stores the numbers in binary
    models. Therefore, its own plugins must come first.
    """
    if "mujoco" in sys.modules or not loads_entry_points():
        import mujoco  # noqa: F401 - registers MuJoCo's own plugins

        register()
