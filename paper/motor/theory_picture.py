"""The picture of the motor's transport beside the sliding disk that moves as its ball does."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import NullLocator

from magmotor.common import style
from paper.motor.spreading import Measured, over_replicas

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from paper.motor.theory_of_transport import Theory

MOTOR: dict[str, Any] = {"fmt": "o", "ms": 4, "lw": 0, "elinewidth": 1, "color": style.BLUE}
ONCE: dict[str, Any] = {"color": style.PURPLE, "fmt": "D", "label": "ball and ring counted once"}
DISK: dict[str, Any] = {"color": style.ORANGE, "lw": 1.6}
WITHOUT: dict[str, Any] = {"color": style.GREEN, "lw": 1.4, "ls": "--"}


def draw(found: "Theory", path: Path) -> None:
    """Draw the mean squares, the density, and diffusion and friction over the temperature."""
    with style.figure(12.0, 8.4) as figure:
        panels = _draw_spread, _draw_density, _draw_diffusion, _draw_friction
        for axes, panel in zip(figure.subplots(2, 2).flat, panels, strict=True):
            panel(axes, found)
        style.save(figure, path, 80)


def _draw_spread(axes: "Axes", found: "Theory") -> None:
    main = found.main
    twice = 2 * main.lag
    value, error = over_replicas(main.squares)
    axes.errorbar(main.lag, value / twice, error / twice, **MOTOR, label="motor")
    axes.plot(
        main.lag,
        main.disks.value / twice,
        **DISK,
        label="sliding disk, one rate measured elsewhere",
    )
    axes.plot(
        main.lag, main.without.value / twice, **WITHOUT,
        label="without the friction under held rings",
    )  # fmt: skip
    axes.set(xscale="log", ylim=(0, None), xlabel="lag t (s)", ylabel="mean square / 2t  (rad²/s)")
    axes.set_title("The ball around its valley is a sliding disk")
    axes.legend(loc="upper left")


def _draw_density(axes: "Axes", found: "Theory") -> None:
    angle = np.degrees(found.wells.azimuth)
    axes.errorbar(angle, found.density.value, found.density.error, **MOTOR, label="motor")
    axes.plot(angle, found.wells.density, **DISK, label="Gibbs' law")
    axes.axhline(1, color=style.GRAY, ls=":", label="rotor without wells")
    axes.set(xlabel="azimuth from an outer dipole to the next (°)", ylabel="density over its mean")
    axes.set_title("The ball is in the wells as often as Gibbs' law says")
    axes.legend(loc="upper center")


def _draw_diffusion(axes: "Axes", found: "Theory") -> None:
    alike = found.by_temperature
    heat = [1e6 * case.scene.kT for case in alike]
    axes.errorbar(heat, *_columns([case.diffusion() for case in alike]), **MOTOR, label="motor")
    for once in (case for case in found.cases if case.scene.ball_ring_factor == 1):
        at = [1e6 * once.scene.kT * 1.05]  # beside the other
        axes.errorbar(at, *_columns([once.diffusion()]), **(MOTOR | ONCE))
        axes.plot(
            at, [once.diffusion(once.disks).value], "_", ms=12, mew=2, color=style.PURPLE,
            label="disk, counted once",
        )  # fmt: skip
    axes.plot(heat, [case.diffusion(case.disks).value for case in alike], **DISK, label="disk")
    axes.plot(
        heat, [case.diffusion(case.without).value for case in alike], **WITHOUT,
        label="without the friction under held rings",
    )  # fmt: skip
    axes.set(yscale="log", ylabel="diffusion coefficient  (rad²/s)")
    _over_temperature(axes, heat)
    axes.set_title("Diffusion over temperature")
    axes.legend(loc="lower right")


def _over_temperature(axes: "Axes", heat: list[float]) -> None:
    axes.set(xscale="log", xlabel="kT (µJ)")
    axes.set_xticks(heat, [f"{each:.2g}" for each in heat])
    axes.xaxis.set_minor_locator(NullLocator())


def _columns(measured: list[Measured]) -> tuple[list[float], list[float]]:
    return [float(each.value) for each in measured], [float(each.error) for each in measured]


def _draw_friction(axes: "Axes", found: "Theory") -> None:
    alike = found.by_temperature
    heat = [1e6 * case.scene.kT for case in alike]
    value, error = _columns([case.friction for case in alike])
    axes.errorbar(
        heat, 1e5 * np.array(value), 1e5 * np.array(error), **MOTOR,
        label="under held rings without wells, measured",
    )  # fmt: skip
    axes.plot(
        heat, [1e5 * case.drag for case in alike], **WITHOUT, label="drag of the leaning ring"
    )
    axes.set_ylim(-0.3, 1.4 * axes.get_ylim()[1])
    axes.set_ylabel("rate of forgetting  (10⁻⁵/s)")
    _over_temperature(axes, heat)
    axes.set_title("The little friction that rolling has")
    axes.legend(loc="upper left")
