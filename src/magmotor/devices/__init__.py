"""The paper's devices, which register themselves on import, and their scene classes."""

from magmotor.devices.disk.device import Disk, LangevinParticle
from magmotor.devices.motor.device import Motor
from magmotor.devices.top.device import Top

__all__ = ["Disk", "LangevinParticle", "Motor", "Top"]
