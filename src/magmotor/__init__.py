"""magmotor: magnetism and temperature for MuJoCo."""

from typing import Any

import lazy_loader

import magmotor_plugin
from magmotor.common.environment import choose_gl_backend

__version__ = "0.1.0"

choose_gl_backend()
magmotor_plugin.register_with_older_mujoco()

_lazy_getattr, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in __all__:
        from magmotor.common.checks import did_you_mean

        hint = did_you_mean(name, __all__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")
    return _lazy_getattr(name)
