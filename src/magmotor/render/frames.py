"""Frames: the whole scene, the ball from near by, and J(t), side by side."""

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.observables import momentum_map
from magmotor.plots import style
from magmotor.render.moments import moments
from magmotor.render.panel import Panel
from magmotor.render.trail import Trail
from magmotor.render.views import Views
from magmotor.scenes import Top
from magmotor.states import rows

HEIGHT, WIDTH = 720, 1280
SIZES = {"front": (HEIGHT, 800), "ball": (HEIGHT // 2, 480)}
"""Height and width in pixels of the views; the panel is as large as the second, and below it."""

TYPESET = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Frames:
    """The frames of a run's movie, each drawn when it is asked for.

    They are drawn inside a `with` block, which holds OpenGL contexts.

    Parameters
    ----------
    run : xarray.Dataset
        With orientations, as from MuJoCo.
    scene : Top
    times : array_like, shape (T,)
        Of the frames, in seconds.
    note : str
        Said below the numbers.

    Raises
    ------
    ValueError
        The run has no orientation.
    NoOpenGL
        On entering: no OpenGL context can be made.
    """

    def __init__(self, run: xr.Dataset, scene: Top, times: ArrayLike, note: str = ""):
        self.scene, self.note = scene, note
        self.moments = moments(run, times)
        self.momentum = momentum_map(scene, self.moments.axis, self.moments.angular_velocity)
        self.exponent = _exponent(run, scene)
        self.trail = Trail(run.time.values, run.position.values, 0.25 * scene.ball_radius)
        self.panel = Panel(run, scene, *SIZES["ball"])

    def __len__(self) -> int:
        """How many there are."""
        return len(self.momentum)

    def __enter__(self) -> "Frames":
        """Open the views."""
        self.views = Views(self.scene, SIZES)
        return self

    def __exit__(self, *error: object) -> None:
        """Close the views."""
        self.views.close()
        del self.views

    def draw(self, i: int) -> NDArray[np.uint8]:
        """Frame i, shape (720, 1280, 3)."""
        moment = rows(self.moments, slice(i, i + 1))
        time, momentum = float(moment.time[0]), float(self.momentum[i])
        self.views.pose(moment)
        main, near = (self.views.draw(camera, self.trail, time) for camera in SIZES)
        side = np.concatenate([near, self.panel.draw(time, momentum)])
        side[:, 0] = side[len(near) - 1] = 255
        return np.concatenate([self._write_on(main, time, momentum), side], axis=1)

    def _write_on(self, picture: NDArray[np.uint8], time: float, momentum: float):
        from PIL import Image, ImageDraw

        spin = momentum / self.scene.inertia[2]
        size, power = momentum / 10.0**self.exponent, str(self.exponent).translate(TYPESET)
        lines = [f"spin  {spin:+z.2f} rad/s", f"J  {size:+z.2f} × 10{power} kg m²/s"]
        if self.scene.ring_script:
            height, tilt = self.scene.ring_pose(time)
            lines.append(f"ring  {100 * height:.1f} cm high, tilt {np.degrees(tilt):.1f}°")
        if self.note:
            lines.append(self.note)
        image = Image.fromarray(picture)
        pen = ImageDraw.Draw(image)
        top = HEIGHT - 24 - 24 * len(lines)
        pen.text((24, top), f"t = {time:.1f} s", style.INK, style.pillow_font(26), "ls")
        for i, line in enumerate(lines, start=1):
            place = (24, top + 24 * i + 4)
            pen.text(place, line.replace("-", "−"), style.INK, style.pillow_font(16), "ls")
        return np.asarray(image)


def _exponent(run: xr.Dataset, scene: Top) -> int:
    """The power of ten in which J is told."""
    largest = np.abs(run.momentum_map.values).max()
    return int(np.floor(np.log10(max(largest, style.NO_SPIN * scene.inertia[2]))))
