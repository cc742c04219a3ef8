"""Devices: what the front door must know of each kind of scene, one module a device.

Each has the functions `methods`, `check_run`, `initial_state`, `guard` and `columns`.
"""

from types import ModuleType

from magmotor.devices import ball, disk
from magmotor.scenes import Disk, LangevinParticle, Top

Scene = Top | Disk | LangevinParticle

DEVICES: dict[type, ModuleType] = {Top: ball, Disk: disk, LangevinParticle: disk}
