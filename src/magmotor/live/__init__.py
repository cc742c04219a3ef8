"""Live simulation: a scene, or any model, that one watches and changes while it moves."""

from magmotor.live.of_scene import live_scene
from magmotor.live.pace import Pace
from magmotor.live.simulation import LiveSimulation, StateLost

__all__ = ["LiveSimulation", "Pace", "StateLost", "live_scene"]
