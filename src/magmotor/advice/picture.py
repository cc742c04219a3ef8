"""Picture of an `Advice`: error against cost, and error against timestep with stability limits."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from magmotor.common import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from magmotor.advice.advice import Advice

LOOKS = {
    "Euler": (style.BLUE, "o"),
    "RK4": (style.ORANGE, "s"),
    "implicit": (style.PURPLE, "v"),
    "implicitfast": (style.GREEN, "^"),
    "discrete": (style.INK, "D"),
}
"""Color and marker of each integrator."""

LEAST = 1e-12
"""Smaller errors are drawn as this."""


def draw(advice: "Advice", path: Path) -> None:
    """Draw what was measured, and write it to a file."""
    with style.figure(10.0, 4.4) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        _panel(left, advice, "seconds")
        _panel(right, advice, "timestep")
        left.set_xlabel("wall time per simulated second (s)")
        left.set_ylabel(f"largest error of {advice.quantity} over its range")
        right.set_xlabel("timestep (s); a vertical line is the stability limit at rest")
        for integrator, limit in advice.limits.items():
            shown = limit.found if np.isnan(limit.theory) else limit.theory
            if np.isfinite(shown):
                color = LOOKS.get(integrator, (style.GRAY, "x"))[0]
                right.axvline(shown, color=color, lw=1.0, ls="--")
        costs = [point.seconds for point in advice.front]
        errors = [max(point.error, advice.doubt, LEAST) for point in advice.front]
        left.step(costs, errors, where="post", color=style.GRAY, lw=1.0, zorder=0)
        left.legend(loc="best")
        figure.savefig(path, dpi=150)


def _panel(axes: "Axes", advice: "Advice", attribute: str) -> None:
    """Draw the points over their cost or timestep."""
    from matplotlib.ticker import NullFormatter

    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())
    for integrator in dict.fromkeys(point.integrator for point in advice.points):
        own = [p for p in advice.points if p.integrator == integrator and np.isfinite(p.error)]
        own.sort(key=lambda point: point.timestep)
        color, marker = LOOKS.get(integrator, (style.GRAY, "x"))
        x = [getattr(point, attribute) for point in own]
        y = [max(point.error, LEAST) for point in own]
        axes.plot(x, y, marker, ls="-", ms=4, lw=0.9, color=color, label=integrator)
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
