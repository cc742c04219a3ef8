"""Readouts of a live simulation: their current values, and their recent curves."""

from collections import deque
from typing import Any

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.device.device import Scene
from magmotor.device.job import Job
from magmotor.live.simulation import LiveSimulation
from magmotor.noise import BrownianPath

INTERVAL, MEAN = 3, 100
"""Frames between two evaluations, and evaluations over which the temperature is averaged."""

LENGTH = 600
"""Largest number of points of a curve, one for each evaluation."""


class Readouts:
    """Numbers that describe the current state of a live simulation, and their recent curves.

    A scene's device defines some of them: for a ball J, spin and azimuth, for the disk x and d.
    Every simulation has one more. With noise it is the kinetic temperature v^T M v / nv, averaged
    over the last 300 frames, with M and nv of MuJoCo; constraints lower it. Without noise it is the
    kinetic energy.

    Parameters
    ----------
    simulation : LiveSimulation

    Attributes
    ----------
    units : dict of str to str
        The unit of each readout by name; "1" if it is dimensionless.
    latest : dict of str to float
        The current values.
    """

    def __init__(self, simulation: LiveSimulation):
        self._simulation, scene = simulation, simulation.scene
        self._own = scene.device.readouts(scene) if scene else {}
        self._adapter = _adapter(scene, simulation) if scene and self._own else None
        energy = "J" if scene is None or scene.device.time_unit == "s" else "1"
        self._is_warm = simulation.declared["noise"]
        self._thermal = "temperature" if self._is_warm else "kinetic energy"
        self.units = {name: own.unit for name, own in self._own.items()} | {self._thermal: energy}
        self._clear()
        self.update()

    def update(self) -> None:
        """Compute the current values, every third time; call this after each frame."""
        time = self._simulation.data.time + 0.0  # not -0
        if self._points and time < self._points[-1][0]:
            self._clear()
        if self._frames % INTERVAL == 0 and not (self._points and time == self._points[-1][0]):
            self.latest = self._own_values() | {self._thermal: self._thermal_value()}
            self._points.append([time, *self.latest.values()])
        self._frames += 1

    @property
    def curves(self) -> tuple[Array, dict[str, Array]]:
        """The times of the points, shape (n,), and the values of each readout there, by name."""
        time, *values = np.array(self._points).T
        return time, dict(zip(self.units, values, strict=True))

    @property
    def rows(self) -> dict[str, str]:
        """The current values as text, by name and unit."""
        return {
            name if unit == "1" else f"{name} ({unit})": f"{self.latest[name]:+.3g}"
            for name, unit in self.units.items()
        }

    def _clear(self) -> None:
        self._frames = 0
        self.latest: dict[str, float] = {}
        self._points: deque[list[float]] = deque(maxlen=LENGTH)
        self._temperatures: deque[float] = deque(maxlen=MEAN)

    def _own_values(self) -> dict[str, float]:
        """Return the values that the scene's device defines."""
        data, scene = self._simulation.data, self._simulation.scene
        if scene is None or self._adapter is None:
            return {}
        qpos, qvel = data.qpos[np.newaxis, np.newaxis], data.qvel[np.newaxis, np.newaxis]
        count = self._adapter.start.shape[-1] - data.qpos.size - data.qvel.size
        states = self._adapter.states(np.zeros(1), qpos, qvel, np.zeros((1, 1, count)))
        columns: Any = scene.device.columns(scene, states, None)
        current = {name: column.values[0] for name, column in columns.items()}
        values = {}
        for name, own in self._own.items():
            value = float(own.value(current))
            if own.period and name in self.latest:
                value += own.period * round((self.latest[name] - value) / own.period)
            values[name] = value
        return values

    def _thermal_value(self) -> float:
        model, data = self._simulation.model, self._simulation.data
        mujoco.mj_energyVel(model, data)
        kinetic = float(data.energy[1])
        if not self._is_warm:
            return kinetic
        self._temperatures.append(2 * kinetic / max(model.nv, 1))
        return float(np.mean(self._temperatures))


def _adapter(scene: Scene, simulation: LiveSimulation) -> Any:
    """Return the translation from MuJoCo's state to the states of the scene's device."""
    timestep = simulation.model.opt.timestep
    first = scene.device.initial_state(scene, None, None)
    path = BrownianPath(0, timestep)
    return scene.device.mujoco(Job(scene, "euler", timestep, 0, 1, first, path, 0))
