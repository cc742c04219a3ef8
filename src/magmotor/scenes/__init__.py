"""Scenes: frozen descriptions of what is simulated, in SI units, with the paper's values."""

from magmotor.scenes.disk import Disk, LangevinParticle
from magmotor.scenes.motor import Motor
from magmotor.scenes.ring_script import Waypoint
from magmotor.scenes.top import Top

__all__ = ["Disk", "LangevinParticle", "Motor", "Top", "Waypoint"]
