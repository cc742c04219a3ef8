"""Frames: the whole scene, its ball from another place, and a curve, side by side."""

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.analysis import checked_run
from magmotor.plots import style
from magmotor.render.moments import joints
from magmotor.render.motor import MotorSubject
from magmotor.render.panel import Panel
from magmotor.render.subject import Subject
from magmotor.render.top import TopSubject
from magmotor.render.trail import Trail
from magmotor.render.views import Views
from magmotor.scenes import Motor, Top

SUBJECTS: dict[type, type] = {Top: TopSubject, Motor: MotorSubject}

HEIGHT, WIDTH = 720, 1280
MAIN, SIDE = (HEIGHT, 800), (HEIGHT // 2, 480)
"""Height and width in pixels of the large view, and of the near view and the panel below it."""


class Frames:
    """The frames of a run's movie, each drawn when it is asked for.

    They are drawn inside a `with` block, which holds OpenGL contexts.

    Parameters
    ----------
    run : xarray.Dataset
        With orientations, which the top's scipy/dop853 has not, and without replicas.
    scene : Top or Motor
    times : array_like, shape (T,)
        Of the frames, in seconds.
    note : str
        Said below the numbers.

    Raises
    ------
    ValueError
        The run has replicas or no orientation, or there are no movies of such a scene.
    NoOpenGL
        On entering: no OpenGL context can be made.
    """

    def __init__(self, run: xr.Dataset, scene: Top | Motor, times: ArrayLike, note: str = ""):
        kind: Any = SUBJECTS[type(scene)]
        run = checked_run("run", run, kind.needs, (type(scene),), records=2, replicas=False)
        self.scene, self.note = scene, note
        self.times = np.asarray(times, dtype=float)
        self.joints = joints(run, scene, self.times)
        self.subject: Subject = kind(run, scene, self.times)
        width = self.subject.trail * scene.ball_radius
        self.trail = Trail(run.time.values, run.position.values, width)
        self.panel = Panel(self.subject.plot, run.time.values[[0, -1]], *SIDE)

    def __len__(self) -> int:
        """How many there are."""
        return len(self.times)

    def __enter__(self) -> "Frames":
        """Open the views."""
        self.views = Views(self.scene, {"front": MAIN, self.subject.near: SIDE})
        return self

    def __exit__(self, *error: object) -> None:
        """Close the views."""
        self.views.close()
        del self.views

    def draw(self, i: int) -> NDArray[np.uint8]:
        """Frame i, shape (720, 1280, 3)."""
        time = float(self.times[i])
        self.views.pose(self.joints[i], time)
        main, near = (self.views.draw(camera, self.trail, time) for camera in self.views.renderers)
        side = np.concatenate([near, self.panel.draw(time, self.subject.value[i])])
        side[:, 0] = side[len(near) - 1] = 255
        return np.concatenate([self._write_on(main, i), side], axis=1)

    def _write_on(self, picture: NDArray[np.uint8], i: int) -> NDArray[np.uint8]:
        from PIL import Image, ImageDraw

        lines = self.subject.lines(i) + [self.note] * bool(self.note)
        image = Image.fromarray(picture)
        pen = ImageDraw.Draw(image)
        top = HEIGHT - 24 - 24 * len(lines)
        pen.text((24, top), f"t = {self.times[i]:.1f} s", style.INK, style.pillow_font(26), "ls")
        for k, line in enumerate(lines, start=1):
            place = (24, top + 24 * k + 4)
            pen.text(place, line.replace("-", "−"), style.INK, style.pillow_font(16), "ls")
        return np.asarray(image)
