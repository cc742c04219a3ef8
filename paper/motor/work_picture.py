"""Pictures of the load on the motor, and of two temperatures."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from magmotor.common import style
from paper.motor.spreading import over_replicas
from paper.motor.work_law import log_ratios

if TYPE_CHECKING:
    from paper.motor.two_temperatures import TwoTemperatures
    from paper.motor.work import Load


EARLIEST = 2000.0
"""In s: before, the thermal motion hides the response."""


def draw_load(data: "Load", path: Path) -> None:
    """Draw the response, the speed, and the law of the work."""
    with style.figure(12.5, 4.0) as figure:
        response, speed, law = figure.subplots(1, 3)
        _draw_response(response, data)
        _draw_speed(speed, data)
        _draw_law(law, data)
        style.save(figure, path, 110, shaded=True)


def draw_temperatures(data: "TwoTemperatures", path: Path) -> None:
    """Draw heat and entropy, the current, and the speed under a load."""
    with style.figure(12.5, 4.0) as figure:
        heat, current, load = figure.subplots(1, 3)
        _draw_heat(heat, data)
        _draw_current(current, data)
        _draw_loads(load, data)
        style.save(figure, path, 110)


def _draw_heat(axes, data: "TwoTemperatures") -> None:
    heats, entropies = data.heats, data.entropies
    axes.errorbar(
        data.ratios, 1e9 * heats.value, 1e9 * heats.error, fmt="o", color=style.BLUE, capsize=3,
        label="heat from ring to ball, nW",
    )  # fmt: skip
    axes.errorbar(
        data.ratios, 1e3 * entropies.value, 1e3 * entropies.error, fmt="s", color=style.ORANGE,
        capsize=3, label="entropy production, 10⁻³ k/s",
    )  # fmt: skip
    axes.axhline(0, color=style.GRAY, lw=0.8)
    _label_ratios(axes, data)
    axes.set_title("Heat and entropy")
    axes.legend(loc="upper left")


def _draw_current(axes, data: "TwoTemperatures") -> None:
    speeds, rates = data.speeds, [1e3 * flow.rate for flow in data.flows]
    axes.plot(data.ratios, rates, color=style.GRAY, ls=":", label="± rms rate")
    axes.plot(data.ratios, [-rate for rate in rates], color=style.GRAY, ls=":")
    axes.errorbar(
        data.ratios, 1e3 * speeds.value, 1e3 * speeds.error, fmt="o", color=style.BLUE, capsize=3,
        label="dipoles at +0.8 rad",
    )  # fmt: skip
    mirrored = over_replicas(data.mirrored.speed)
    axes.errorbar(
        1.12 * data.ratios[-1], 1e3 * mirrored.value, 1e3 * mirrored.error, fmt="^",
        color=style.PURPLE, capsize=3, label="at −0.8 rad",
    )  # fmt: skip
    axes.axhline(0, color=style.GRAY, lw=0.8)
    _label_ratios(axes, data)
    axes.set_title("Mean speed without a load, 10⁻³ rad/s")
    axes.legend(loc="center left", bbox_to_anchor=(0.0, 0.7))


def _draw_loads(axes, data: "TwoTemperatures") -> None:
    groups = (
        (data.loads[:2], "o", style.BLUE, "chiral ring, hot"),
        (data.loads[2:], "s", style.ORANGE, "the paper's, nonuniform"),
    )
    for group, marker, color, label in groups:
        found = [over_replicas(flow.speed) for _, flow in group]
        torques = [1e7 * torque for torque, _ in group]
        axes.errorbar(
            torques, [1e3 * each.value for each in found], [1e3 * each.error for each in found],
            fmt=f"{marker}-", color=color, capsize=3, label=label,
        )  # fmt: skip
    axes.axhline(0, color=style.GRAY, lw=0.8)
    axes.axvline(0, color=style.GRAY, lw=0.8)
    axes.set_xlabel("load (10⁻⁷ N m)")
    axes.set_title("Mean speed under a load, 10⁻³ rad/s")
    axes.legend(loc="upper left")


def _label_ratios(axes, data: "TwoTemperatures") -> None:
    axes.set_xscale("log", base=2)
    axes.set_xticks(data.ratios, [f"{ratio:g}" for ratio in data.ratios])
    axes.set_xlabel("temperature of the ring over that of the ball")


def _draw_response(axes, data: "Load") -> None:
    after = data.time >= EARLIEST
    time, predicted = data.time[after] / 1e3, data.spread
    low, high = (predicted.value + sign * predicted.error for sign in (-1, 1))
    axes.fill_between(time, low[after], high[after], color=style.ORANGE, alpha=0.35, lw=0)
    axes.plot(
        time, predicted.value[after], color=style.ORANGE, label="Einstein: E[φ²]/(2 kT), no load"
    )
    strengths = sorted({abs(float(torque)) for torque in data.torque})
    colors = (style.GREEN, style.BLUE, style.PURPLE)
    for number, (strength, color) in enumerate(zip(strengths, colors, strict=False)):
        found = data.response(np.abs(data.torque) == strength)
        shown = np.searchsorted(data.time, np.geomspace(1.1 + 0.1 * number, 19, 7) * EARLIEST)
        shown = shown[shown < len(data.time)]
        axes.errorbar(
            data.time[shown] / 1e3, found.value[shown], found.error[shown], fmt="osD"[number],
            color=color, ms=5, capsize=2, label=f"load {_tens(strength)} N m",
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(1e6, None)
    ticks = (2, 5, 10, 20, 40)
    axes.set_xticks(ticks, map(str, ticks))
    axes.minorticks_off()
    axes.set_xlim(1.8, 1.1e-3 * data.time[-1])
    axes.set_xlabel("time since the load began (10³ s)")
    axes.set_title("Mean angle over torque, rad/(N m)")
    axes.legend(loc="upper left")


def _draw_speed(axes, data: "Load") -> None:
    speeds, mobility = data.speeds, data.mobility
    reach = 1.1e7 * np.abs(data.torque).max()
    line = np.array([-0.6 * reach, reach])
    axes.plot(
        line, 1e-4 * mobility.value * line, color=style.ORANGE, label="Einstein, for small loads"
    )
    axes.errorbar(
        1e7 * data.torque, 1e3 * speeds.value, 1e3 * speeds.error, fmt="o", color=style.BLUE,
        capsize=3, label="measured",
    )  # fmt: skip
    axes.axhline(0, color=style.GRAY, lw=0.8)
    axes.axvline(0, color=style.GRAY, lw=0.8)
    axes.set_xlabel("load (10⁻⁷ N m)")
    axes.set_title("Mean speed, 10⁻³ rad/s")
    axes.legend(loc="upper left")


def _draw_law(axes, data: "Load") -> None:
    edges = np.linspace(0, 4, 9)
    mean, ratio, error = log_ratios(data.works.ravel(), edges)
    line = np.array([0, 4])
    axes.plot(line, line, color=style.ORANGE, label="W/kT, kT = α²/(2c)")
    axes.plot(line, line / 2, color=style.GRAY, ls=":", label="W/kT, kT = α²/c")
    axes.errorbar(mean, ratio, error, fmt="o", color=style.BLUE, capsize=3, label="measured")
    axes.set_xlabel("work W of the load in 10⁴ s (kT)")
    axes.set_title("ln P(W)/P(−W)")
    axes.legend(loc="upper left")


def _tens(number: float) -> str:
    mantissa, exponent = f"{number:.0e}".split("e")
    return (
        f"{mantissa}·10{str(int(exponent)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"
    )
