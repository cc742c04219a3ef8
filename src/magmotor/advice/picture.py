"""Picture of an `Advice`: error against cost, and error against timestep with stability limits."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from magmotor.advice.points import Point
from magmotor.advice.stability import Limit
from magmotor.common import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEAST = 1e-12
"""Smaller errors are drawn as this."""


def draw(  # noqa: PLR0913 (what is drawn)
    path: Path, dpi: int, points: Sequence[Point], front: Sequence[Point],
    limits: Mapping[str, Limit], *, error: float, doubt: float, chosen: Point | None,
    own: Point | None, of: str,
) -> None:  # fmt: skip
    """Draw points and their front, the error asked for and the reference's doubt, to a file.

    What is recommended and the model's own are marked. `of` is what the errors are of.
    """
    marks = (
        (chosen, {"label": "advice", "marker": "*", "ms": 14, "mec": style.INK}),
        (own, {"label": "the model's own", "marker": "o", "ms": 12, "mec": style.GRAY}),
    )
    with style.figure(10.0, 4.4) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        for axes, attribute in ((left, "seconds"), (right, "timestep")):
            _panel(axes, points, attribute)
            axes.axhline(error, color=style.GRAY, lw=1.0)
            axes.set_ylim(0.3 * min([*map(_shown, points), error]), 2.0)
            axes.axhspan(LEAST**2, max(doubt, LEAST), color=style.GRAY, alpha=0.15, lw=0)
            for point, look in marks:
                if point is not None and np.isfinite(point.error):
                    x = getattr(point, attribute)
                    axes.plot(x, _shown(point), ls="", mfc="none", **look)
        left.set_xlabel("wall time per simulated second (s)")
        left.set_ylabel(f"largest error of {of} over its range")
        right.set_xlabel("timestep (s); a vertical line is the stability limit at rest")
        for integrator, limit in limits.items():
            shown = limit.found if np.isnan(limit.theory) else limit.theory
            if np.isfinite(shown):
                color = _look(integrator)["color"]
                right.axvline(shown, color=color, lw=1.0, ls="--")
        costs = [point.seconds for point in front]
        errors = [max(_shown(point), doubt) for point in front]
        left.step(costs, errors, where="post", color=style.GRAY, lw=1.0, zorder=0)
        left.legend(loc="best")
        style.save(figure, path, dpi)


def _look(integrator: str) -> dict[str, Any]:
    return style.method_look(f"mujoco/{integrator.lower()}")


def _shown(point: Point) -> float:
    return max(point.error, LEAST)


def _panel(axes: "Axes", points: Sequence[Point], attribute: str) -> None:
    """Draw the points over their cost or timestep."""
    from matplotlib.ticker import NullFormatter

    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())
    for integrator in dict.fromkeys(point.method for point in points):
        curve = [p for p in points if p.method == integrator and np.isfinite(p.error)]
        curve.sort(key=lambda point: point.timestep)
        x, y = [getattr(point, attribute) for point in curve], [*map(_shown, curve)]
        axes.plot(x, y, ms=5, lw=0.9, label=integrator, **_look(integrator))
