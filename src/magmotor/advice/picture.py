"""Picture of an `Advice`: error against cost, and error against timestep with stability limits."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from magmotor.common import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from magmotor.advice.advice import Advice

LEAST = 1e-12
"""Smaller errors are drawn as this."""


def draw(advice: "Advice", path: Path, dpi: int) -> None:
    """Draw what was measured, and write it to a file."""
    with style.figure(10.0, 4.4) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        _panel(left, advice, "seconds")
        _panel(right, advice, "timestep")
        left.set_xlabel("wall time per simulated second (s)")
        each = advice.every_element and len(advice.ranges) > 1
        left.set_ylabel(
            f"largest error of {'any element' if each else advice.quantity} over its range"
        )
        right.set_xlabel("timestep (s); a vertical line is the stability limit at rest")
        for integrator, limit in advice.limits.items():
            shown = limit.found if np.isnan(limit.theory) else limit.theory
            if np.isfinite(shown):
                color = _look(integrator)["color"]
                right.axvline(shown, color=color, lw=1.0, ls="--")
        costs = [point.seconds for point in advice.front]
        errors = [max(point.error, advice.doubt, LEAST) for point in advice.front]
        left.step(costs, errors, where="post", color=style.GRAY, lw=1.0, zorder=0)
        left.legend(loc="best")
        style.save(figure, path, dpi)


def _look(integrator: str) -> dict[str, Any]:
    return style.method_look(f"mujoco/{integrator.lower()}")


def _panel(axes: "Axes", advice: "Advice", attribute: str) -> None:
    """Draw the points over their cost or timestep."""
    from matplotlib.ticker import NullFormatter

    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())
    for integrator in dict.fromkeys(point.integrator for point in advice.points):
        own = [p for p in advice.points if p.integrator == integrator and np.isfinite(p.error)]
        own.sort(key=lambda point: point.timestep)
        x = [getattr(point, attribute) for point in own]
        y = [max(point.error, LEAST) for point in own]
        axes.plot(x, y, ms=5, lw=0.9, label=integrator, **_look(integrator))
    axes.axhline(advice.error, color=style.GRAY, lw=1.0)
    shown = [max(point.error, LEAST) for point in advice.points]
    axes.set_ylim(0.3 * min([*shown, advice.error]), 2.0)
    axes.axhspan(LEAST**2, max(advice.doubt, LEAST), color=style.GRAY, alpha=0.15, lw=0)
    for point in advice.points:
        if (point.integrator, point.timestep) == (advice.integrator, advice.timestep):
            axes.plot(
                getattr(point, attribute), max(point.error, LEAST), "*", ms=14,
                mfc="none", mec=style.INK, label="advice",
            )  # fmt: skip
    if advice.own is not None and np.isfinite(advice.own.error):
        axes.plot(
            getattr(advice.own, attribute), max(advice.own.error, LEAST), "o", ms=12,
            mfc="none", mec=style.GRAY, label="the model's own",
        )  # fmt: skip
