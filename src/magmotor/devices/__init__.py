"""The paper's devices, which register themselves, and the scenes that describe them."""

from magmotor.devices.disk.device import Disk, LangevinParticle
from magmotor.devices.motor.device import Motor
from magmotor.devices.top.device import Top

__all__ = ["Disk", "LangevinParticle", "Motor", "Top"]
