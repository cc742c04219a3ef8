"""The picture of the motor's transport."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from magmotor.common import style
from paper.motor.spreading import Measured, over_replicas, rotor_square

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from paper.motor.transport import Transport

MOTOR: dict[str, Any] = {"color": style.BLUE, "label": "motor"}
PHYSICAL: dict[str, Any] = {"color": style.PURPLE, "label": "motor, ball and ring counted once"}
ROTOR: dict[str, Any] = {"color": style.ORANGE, "ls": "--", "lw": 1.4}
DOTS: dict[str, Any] = {"fmt": "o", "ms": 3.5, "lw": 0, "elinewidth": 1}


def draw(found: "Transport", path: Path) -> None:
    """Draw slopes, mean squares, correlation and its integral."""
    with style.figure(12.0, 8.4) as figure:
        panels = figure.subplots(2, 2)
        for axes, panel in zip(
            panels.flat, (_slopes, _squares, _correlation, _diffusion), strict=True
        ):
            panel(axes, found)
            axes.set(xscale="log", xlim=(8, 1.3 * found.motor.lag[-1]))
        style.save(figure, path, 80)


def _slopes(axes: "Axes", found: "Transport") -> None:
    kept = found.by_mujoco.slopes
    for slopes, look in (
        (found.motor.slopes, MOTOR | DOTS),
        (found.physical.slopes, PHYSICAL | DOTS),
        (kept, {"color": style.INK, "label": "MuJoCo's motor"} | DOTS | {"fmt": "x", "ms": 5}),
    ):
        axes.errorbar(slopes.lag, slopes.slope, slopes.error, **look)
    axes.plot(found.motor.slopes.lag, found.rotor_slopes, **ROTOR, label="rotor without wells")
    axes.plot(
        found.disk.lag, found.disk.slope, color=style.GREEN, ls=":", lw=1.8,
        label="sliding disk, time scaled",
    )  # fmt: skip
    axes.set(ylim=(0.7, 2.1), xlabel="lag (s)", ylabel="local slope")
    axes.set_title("Ballistic for two decades, diffusive in the end")
    axes.legend(loc="lower left")


def _squares(axes: "Axes", found: "Transport") -> None:
    for spread, look in ((found.motor, MOTOR), (found.physical, PHYSICAL)):
        axes.errorbar(spread.lag, *over_replicas(spread.squares), **(look | DOTS))
    lag = found.motor.lag
    axes.plot(
        lag, rotor_square(found.rate, found.memory, lag), **ROTOR, label="rotor without wells"
    )  # fmt: skip
    for power, start, scale in ((2, lag[0], 0.2), (1, lag[-1] / 30, 2.5)):
        near = lag[(lag >= start) & (lag <= 30 * start)]
        level = rotor_square(found.rate, found.memory, near[:1])[0] * scale
        axes.plot(near, level * (near / near[0]) ** power, color=style.GRAY, lw=1)
        axes.annotate(
            f"t{'²' if power == 2 else ''}", (near[-1], level * (near[-1] / near[0]) ** power),
            xytext=(-4, -12), textcoords="offset points", color=style.GRAY,
        )  # fmt: skip
    axes.set(yscale="log", xlabel="lag t (s)", ylabel="E[(φ(t) − φ(0))²]  (rad²)")
    axes.set_title("Mean square displacement of the azimuth")
    axes.legend(loc="upper left")


def _binned(values: Any, interval: float, per_decade: int = 8) -> tuple[Any, Measured]:
    """Average each replica's values, at lags from `interval` on, in logarithmic bins."""
    lag = interval * np.arange(1, values.shape[1])
    edges = np.geomspace(lag[0], lag[-1] * 1.001, int(per_decade * np.log10(len(lag))) + 1)
    bins = np.digitize(lag, edges) - 1
    used = np.unique(bins)
    centers = np.array([lag[bins == each].mean() for each in used])
    means = np.stack([values[:, 1:][:, bins == each].mean(axis=1) for each in used], axis=1)
    return centers, over_replicas(means)


def _correlation(axes: "Axes", found: "Transport") -> None:
    lag, measured = _binned(found.correlation, found.interval)
    axes.errorbar(lag, 1e6 * measured.value, 1e6 * measured.error, **(MOTOR | DOTS))
    smooth = found.motor.lag
    exponential = 1e6 * found.rate**2 * np.exp(-smooth / found.memory)
    axes.plot(smooth, exponential, **ROTOR, label="rotor without wells")
    axes.axhline(0, color=style.GRAY, lw=0.8)
    axes.set(xlabel="lag (s)", ylabel="correlation of the rate  ((mrad/s)²)")
    axes.set_title("Wells take a quarter of the correlation within 500 s")
    axes.legend(loc="upper right")


def _diffusion(axes: "Axes", found: "Transport") -> None:
    lag = found.interval * np.arange(1, found.integral.shape[1])
    kept = np.unique(np.rint(np.geomspace(1, len(lag), 60)).astype(int)) - 1
    mean, error = over_replicas(found.integral[:, 1:][:, kept])
    axes.plot(lag[kept], mean, color=style.BLUE, label="integral of the correlation (Green-Kubo)")
    axes.fill_between(lag[kept], mean - error, mean + error, color=style.BLUE, alpha=0.2, lw=0)
    growth = over_replicas(found.motor.squares / (2 * found.motor.lag))
    look: dict[str, Any] = DOTS | {"color": style.INK, "label": "mean square / 2t"}
    axes.errorbar(found.motor.lag, growth.value, growth.error, **look)
    exact = found.rate**2 * found.memory * -np.expm1(-lag[kept] / found.memory)
    axes.plot(lag[kept], exact, **ROTOR, label="rotor's integral")
    axes.set(xlabel="lag t (s)", ylabel="diffusion coefficient  (rad²/s)", ylim=(0, None))
    axes.set_title("The diffusion coefficient, from velocities and from displacements")
    axes.legend(loc="upper left")
