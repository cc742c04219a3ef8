"""Devices: what the front door must know of each kind of scene, one module a device.

Each has the functions `methods`, `check_run`, `initial_state`, `guard` and `columns`.
"""

from types import ModuleType

from magmotor.checks import reject
from magmotor.devices import ball, disk, motor
from magmotor.scenes import Disk, LangevinParticle, Motor, Top

Scene = Top | Motor | Disk | LangevinParticle

DEVICES: dict[type, ModuleType] = {Top: ball, Motor: motor, Disk: disk, LangevinParticle: disk}


def device_of(scene: Scene) -> ModuleType:
    """The module of a scene.

    Raises
    ------
    ValueError
        It is none.
    """
    if type(scene) not in DEVICES:
        raise reject("scene", scene, "a scene, such as magmotor.Top()")
    return DEVICES[type(scene)]
