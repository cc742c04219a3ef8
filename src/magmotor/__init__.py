"""magmotor: magnetism and temperature for MuJoCo."""

import lazy_loader

import magmotor_plugin
from magmotor.common.environment import choose_cache_folder, choose_gl_backend

__version__ = "0.1.0"

choose_cache_folder()
choose_gl_backend()
magmotor_plugin.register_with_older_mujoco()

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
