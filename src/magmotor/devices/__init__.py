"""Devices: what the front door must know of each kind of scene, one module a device.

Each has the functions `methods`, `check_run`, `initial_state`, `guard` and `columns`.
"""

from types import ModuleType

from magmotor.common.checks import reject
from magmotor.devices.disk import device as disk
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.motor import device as motor
from magmotor.devices.motor.scene import Motor
from magmotor.devices.top import device as ball
from magmotor.devices.top.scene import Top

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
