"""The paper's devices, and the scenes that describe them."""

from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.motor.scene import Motor
from magmotor.devices.top.scene import Top, Waypoint

__all__ = ["Disk", "LangevinParticle", "Motor", "Top", "Waypoint"]
