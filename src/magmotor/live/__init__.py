"""Live simulation: a scene, or any model, that one watches and changes while it moves."""

from magmotor.live.simulation import LiveSimulation, Pace, StateLost, live_scene

__all__ = ["LiveSimulation", "Pace", "StateLost", "live_scene"]
