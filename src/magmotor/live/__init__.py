"""Live simulation: a scene, or any model, to watch and change while it moves."""

from magmotor.live.loop import Loop
from magmotor.live.simulation import LiveSimulation, Pace, StateLost, live_scene
from magmotor.live.web import WebView, web

__all__ = ["LiveSimulation", "Loop", "Pace", "StateLost", "WebView", "live_scene", "web"]
