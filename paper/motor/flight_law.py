"""The law of the motor's flights by several definitions, and that of a rotor without wells."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from magmotor.common import style
from magmotor.common.style import save_small
from magmotor.devices.motor.exponential_test import LEVEL
from paper.figure import OURS, Claim, Figure, Verdict
from paper.motor.azimuths import ENSEMBLES, METHOD, RECORD_INTERVAL, azimuths
from paper.motor.flight_definitions import DEFINITIONS, Remaining, remaining
from paper.motor.rotor import RateAndMemory, rate_and_memory, rotor
from paper.motor.runs import DURATION, SIGNIFICANT

FEW = 300
"""Flights below which no law is judged."""

ROTOR = "rotor"

LOOKS = {
    "uniform": (style.BLUE, "o", "uniform temperature"),
    "factor 1": (style.PURPLE, "D", "uniform, ball and ring counted once"),
    "nonuniform": (style.ORANGE, "s", "nonuniform temperature"),
    "air at 2 mm/s": (style.GREEN, "^", "uniform, in air at 2 mm/s"),
    "air at 20 mm/s": (style.GREEN, "v", "uniform, in air at 20 mm/s"),
    ROTOR: (style.INK, "x", "rotor without wells"),
}
"""Color, marker and label of each ensemble."""


class Laws(NamedTuple):
    """What is left of the flights of each ensemble, by each definition."""

    method: str
    found: dict[str, dict[str, Remaining]]
    measured: RateAndMemory
    """of the ball at uniform temperature, which the rotor shares"""
    runs: dict[str, int]


def compute(quick: bool) -> Laws:
    """Simulate the ensembles, and draw as many rotors as there are motors."""
    rows = {name: azimuths(name, quick).rows for name in ENSEMBLES}
    uniform = rows["uniform"]
    measured = rate_and_memory(uniform, RECORD_INTERVAL)
    times = RECORD_INTERVAL * np.arange(len(uniform[0]))
    rows[ROTOR] = [*rotor(*measured, times, len(uniform), seed=1)]
    found = {
        name: {key: remaining(paths, each) for key, each in DEFINITIONS.items()}
        for name, paths in rows.items()
    }
    return Laws(METHOD, found, measured, {name: len(paths) for name, paths in rows.items()})


def claims(laws: Laws) -> list[Claim]:
    """Return the claims, all of which are ours."""
    return [
        *(_law_of(name, laws) for name in ENSEMBLES),
        _tail(laws),
    ]


def _law_of(name: str, laws: Laws) -> Claim:
    says = (
        f"{OURS}the law of flights is not exponential, whatever counts as a flight"
        f" ({LOOKS[name][2]})"
    )
    found = laws.found[name]
    count = f"{len(found['once'].lasts)} flights by the first definition in {laws.runs[name]} runs"
    if len(found["once"].lasts) < FEW:
        return Claim(says, count, "not decided")
    parts, rejected = [], []
    for key, definition in DEFINITIONS.items():
        value, error = found[key].squared_variation
        test = found[key].test
        rejected.append(test.rejected)
        parts.append(f"{definition.label}: {value:.2f} ± {error:.2f} (p = {test.p_value:.2g})")
    return Claim(
        says,
        f"squared coefficient of variation of what is left of a flight, 1 if exponential:"
        f" {'; '.join(parts)}; {count}; {sum(rejected)} of {len(rejected)} definitions reject an"
        f" exponential law at {100 * LEVEL:g} %",
        "right" if all(rejected) else "in part" if any(rejected) else "wrong",
    )


def _tail(laws: Laws) -> Claim:
    motor, null = (laws.found[name]["once"].squared_variation for name in ("uniform", ROTOR))
    excess = (motor[0] - null[0]) / np.hypot(motor[1], null[1])
    enough = len(laws.found["uniform"]["once"].lasts) >= FEW
    verdict: Verdict = "right" if excess > SIGNIFICANT else "wrong"
    return Claim(
        f"{OURS}the law of flights has a heavier tail than that of a rotor without wells",
        f"at uniform temperature {motor[0]:.2f} ± {motor[1]:.2f} against {null[0]:.2f} ±"
        f" {null[1]:.2f} for rotors of the same rate ({1e3 * laws.measured.rate:.2f} mrad/s over"
        f" 100 s) and memory ({laws.measured.memory:.0f} s), by the first definition:"
        f" {excess:.1f} standard errors",
        verdict if enough else "not decided",
    )


def draw(laws: Laws, path: Path) -> None:
    """Draw the squared variation by each definition, and the survival of flights by the first."""
    with style.figure(12.5, 5.0) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
        rows = np.arange(len(DEFINITIONS))[::-1]
        for number, (name, (color, marker, label)) in enumerate(LOOKS.items()):
            values, errors = np.array(
                [laws.found[name][key].squared_variation for key in DEFINITIONS]
            ).T
            left.errorbar(
                values, rows + 0.3 - 0.12 * number, xerr=errors, color=color, fmt=marker, ms=5,
                label=label,
            )  # fmt: skip
        left.axvline(1, color=style.GRAY, ls="--", lw=1.2)
        left.set_yticks(rows, [each.label.replace(", ", ",\n") for each in DEFINITIONS.values()])
        left.set(xlabel="squared coefficient of variation of what is left of a flight")
        left.set_title("1 if exponential (dashed); bars: standard error")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        for name in ("uniform", "air at 20 mm/s", ROTOR):
            color, _, label = LOOKS[name]
            flights = laws.found[name]["once"]
            mean = flights.lasts.sum() / (~flights.censored).sum()
            times, survival = flights.survival
            right.plot(times / mean, survival, color=color, label=f"{label}: mean {mean:.0f} s")
        times = np.linspace(0, 7, 50)
        right.plot(times, np.exp(-times), color=style.GRAY, ls="--", label="exponential")
        right.set(
            xlabel="time after the first revolution / mean", xlim=(0, 7), yscale="log",
            ylabel="part of flights that last longer", ylim=(1e-3, 1.2),
        )  # fmt: skip
        right.set_title("Flights by the first definition")
        right.legend()
        save_small(figure, path, dpi=80)


FIGURE = Figure(
    "motor_flight_law",
    "Motor: the law of its flights, by definition",
    "How long a flight still lasts, counted from where it has become one by each of five"
    f" definitions, in runs of up to {DURATION:g} s (h = 0.4 s; nonuniform: nonuniform-a,"
    " h = 0.1 s). A *sector* is the angle between two wells. The rate is averaged over 200 s."
    " Durations that the end of a run cuts off are censored; errors are by the jackknife over"
    " runs. The rotor is an Ornstein-Uhlenbeck process of the same rate and memory, without wells,"
    " by the same code. The drag of air is that at a ball's speed of 2 mm/s, which the ball has,"
    " and at 20 mm/s, where it is 2.6 times as large.",
    compute,
    claims,
    draw,
    (),
    (METHOD,),
)
