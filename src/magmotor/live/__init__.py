"""Live simulation: a scene, or any model, to watch and change while it moves."""

from magmotor.live.simulation import LiveSimulation, Pace, StateLost, live_scene

__all__ = ["LiveSimulation", "Pace", "StateLost", "live_scene"]
