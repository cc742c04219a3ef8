"""What happens between two frames of a live view, in a window or in a browser."""

import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.live.readouts import Readouts
from magmotor.live.simulation import LONGEST_FRAME, LiveSimulation, Pace, StateLost
from magmotor.mjcf.arrows import draw_field, draw_moments
from magmotor.mjcf.field_and_energy import dipole_sites

SWITCHES = {"8": "noise", "9": "magnetism"}
"""Keys without a function in MuJoCo's viewer, unlike all letters."""

ARROWS = "none", "moments", "moments and field"
"""What the arrows show; the key `.` selects the next."""

PIECE = 50
"""Number of steps between two looks at the clock."""

POINTS, MARGIN = 11, 0.3
"""Number of arrows of the field in each direction, and how far they extend beyond the dipoles, in
extents of these."""


class Loop:
    """The actions between two frames: controls, steps, arrows and readouts.

    Parameters
    ----------
    simulation : LiveSimulation
    speed : float
        Simulated seconds per second.
    report : callable, optional
        Receives a line if the state is lost.

    Attributes
    ----------
    paused : bool
    arrows : str
        One of `ARROWS`. At the beginning `none` for a scene, whose magnets have arrows of their
        own, and `moments` for any other model.
    readouts : Readouts
    """

    def __init__(
        self,
        simulation: LiveSimulation,
        speed: float,
        report: Callable[[str], Any] = lambda _: None,
    ):
        self.simulation, self.paused, self._report = simulation, False, report
        self.pace = Pace(speed, time.perf_counter())
        self.readouts, scene = Readouts(simulation), simulation.scene
        self._unit = " (s)" if scene is None or scene.device.time_unit == "s" else ""
        self.is_magnetic = len(dipole_sites(simulation.model, simulation.data)[0]) > 0
        self.arrows = "moments" if self.is_magnetic and not scene else "none"

    def press(self, key: int) -> None:
        """Act on a key, given as its code."""
        match chr(key):
            case " ":
                self.paused = not self.paused
            case "6":
                self.pace.speed /= 2
            case "7":
                self.pace.speed *= 2
            case "." if self.is_magnetic:
                self.arrows = ARROWS[(ARROWS.index(self.arrows) + 1) % len(ARROWS)]
            case switch if switch in SWITCHES:
                self.simulation.switch(SWITCHES[switch])

    def step(self, now: float, perturb: mujoco.MjvPerturb) -> None:
        """Take the steps that are due at a wall time (s); if the state is lost, reset and pause."""
        steps = self.pace.steps(now, self.simulation.model.opt.timestep)
        if self.paused:
            self.simulation.hold(perturb)
            return
        late = time.perf_counter() + LONGEST_FRAME  # the rest is skipped, so that inputs act
        try:
            while steps > 0 and time.perf_counter() < late:
                self.simulation.advance(min(steps, PIECE), perturb)
                steps -= PIECE
        except StateLost as error:
            self.simulation.reset()
            self.simulation.notice = f"{error}: reset and paused"
            self.paused = True
            self._report(f"{error}: reset and paused")
        self.readouts.update()

    def draw(self, view: mujoco.MjvScene) -> None:
        """Replace the contents of a scene by the arrows; turn them off if it has no room."""
        view.ngeom = 0
        model, data = self.simulation.model, self.simulation.data
        try:
            if self.arrows != "none":
                draw_moments(view, model, data)
            if self.arrows == "moments and field":
                points, spacing = _grid(dipole_sites(model, data)[0])
                draw_field(view, model, data, points, length=0.7 * spacing)
        except ValueError as error:
            view.ngeom, self.arrows = 0, "none"
            self.simulation.notice = str(error)

    def rows(self) -> dict[str, str]:
        """Return the readouts, with time and speed, as text by name."""
        simulation = self.simulation
        return {
            f"time{self._unit}": f"{simulation.data.time + 0.0:.1f}",
            "speed": f"{self.pace.speed:g}",
        } | self.readouts.rows

    def texts(self) -> tuple[str, str]:
        """Return the two text columns shown in a window, which also explain the keys."""
        simulation, rows = self.simulation, self.rows()
        rows = {("6, 7: speed" if name == "speed" else name): text for name, text in rows.items()}
        for key, name in SWITCHES.items():
            if simulation.declared[name]:
                rows[f"{key}: {name}"] = "on" if simulation.on[name] else "off"
        if self.is_magnetic:
            rows[".: arrows"] = self.arrows
        rows["space"] = "paused" if self.paused else "pause"
        rows["Backspace"] = "reset"
        if simulation.notice:
            rows[simulation.notice] = ""
        return "\n".join(rows), "\n".join(rows.values())


def _grid(dipoles: Array) -> tuple[Array, float]:
    """Return points of a grid, shape (n, 3), and their spacing, in m.

    The grid is in the plane, parallel to two coordinate axes, along which the dipoles, shape
    (n, 3), extend farthest.
    """
    low, high = dipoles.min(axis=0), dipoles.max(axis=0)
    across = int(np.argmin((high - low)[::-1]))  # the last of equal ones: a horizontal plane
    along = [axis for axis in range(3) if axis != 2 - across]
    reach = (0.5 + MARGIN) * max(float((high - low).max()), 1e-3)
    line = np.linspace(-reach, reach, POINTS)
    points = np.tile((low + high) / 2, (POINTS * POINTS, 1))
    points[:, along] += np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    return points, float(line[1] - line[0])
