"""The picture of the barriers ahead of the motor's ball."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from magmotor.common import style
from paper.motor.crossings import LAGS
from paper.motor.hop_barriers import Ahead, Found

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NOW_LOOKS: dict[str, dict[str, Any]] = {
    "hops": {"color": style.BLUE, "label": "at hops"},
    "passes": {"color": style.GREEN, "ls": "--", "label": "at passages in flight"},
    "waiting": {"color": style.INK, "ls": ":", "label": "at random times in a well"},
}

AROUND_LOOKS: dict[str, dict[str, Any]] = {
    "hops": {"color": style.BLUE, "fmt": "o-", "label": "hops"},
    "passes": {"color": style.GREEN, "fmt": "s-", "label": "passages in flight"},
    "other": {"color": style.ORANGE, "fmt": "^-", "label": "hops, with the lean of another ring"},
}


def draw(found: Found, path: Path) -> None:
    """Draw the valley, the barriers at crossings, and the barriers around them."""
    kT = found.valley.motor.kT
    with style.figure(12.5, 8.6) as figure:
        (valley, spread), (warm, hot) = figure.subplots(2, 2)
        _draw_valley(valley, found)
        _draw_spread(spread, found.uniform, kT)
        _draw_around(warm, found.uniform, kT)
        core, halfway = (barrier / kT for barrier in found.gibbs)
        warm.axhline(core, color=style.GRAY, ls="--", lw=1.2, label="Gibbs' law: ball in a well")
        warm.plot(0, halfway, "*", color=style.INK, ms=12, label="Gibbs' law: ball halfway")
        warm.set(ylabel="mean barrier ahead / kT", ylim=(0, None))
        warm.set_title("Around the crossing, uniform temperature")
        warm.legend(fontsize=8)
        _draw_around(hot, found.nonuniform, 1e-6)
        hot.set(ylabel="mean barrier ahead (µJ)", ylim=(0, None))
        hot.set_title("Around the crossing, nonuniform temperature")
        hot.legend(fontsize=8)
        style.save(figure, path, dpi=80)


def _draw_valley(axes: "Axes", found: Found) -> None:
    lean, valley = found.lean.value, found.valley
    sides = {
        "level": (0.0, style.INK, "-"),
        "leans toward the next well": (1.0, style.BLUE, "--"),
        "leans away from it": (-1.0, style.ORANGE, "-."),
    }
    for label, (side, color, line) in sides.items():
        toward = side * lean * np.array([np.cos(valley.sector), np.sin(valley.sector)])
        energy = valley.energies(toward[np.newaxis])[0] / valley.motor.kT
        azimuth = np.degrees(valley.azimuths)
        axes.plot(azimuth, energy - energy.min(), color=color, ls=line, label=label)
    axes.set(xlabel="azimuth from a well (°)", ylabel="energy of the ball in the valley / kT")
    axes.set_title(f"Two wells, with the ring level or leaning by {np.degrees(lean):.2f}°")
    axes.legend()


def _draw_spread(axes: "Axes", ahead: Ahead, kT: float) -> None:
    for kind, look in NOW_LOOKS.items():
        values = np.sort(ahead.now[kind].values) / kT
        axes.plot(values, np.arange(1, len(values) + 1) / len(values), **look)
    axes.set(xlabel="barrier ahead of the ball / kT", xlim=(0, 4))
    axes.set(ylabel="part of barriers that are lower", ylim=(0, 1))
    axes.set_title("Barriers at uniform temperature")
    axes.legend(loc="lower right")


def _draw_around(axes: "Axes", ahead: Ahead, unit: float) -> None:
    for kind, look in AROUND_LOOKS.items():
        found = ahead.around[kind]
        mean, error = found.values.mean(axis=0) / unit, found.error / unit
        axes.errorbar(LAGS, mean, yerr=error, ms=3.5, lw=1.0, **look)
    axes.axvline(0, color=style.GRAY, lw=0.8)
    axes.set(xlabel="time after the ball passes halfway (s)")
