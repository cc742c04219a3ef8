"""The law of the motor's flights by several definitions, and that of a rotor without wells."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common import style
from paper.figure import OURS, Claim, Figure, Verdict
from paper.motor.azimuths import ENSEMBLES, METHOD, RECORD_INTERVAL, azimuths
from paper.motor.flight_definitions import DEFINITIONS, Remaining, remaining
from paper.motor.rotor import RateAndMemory, rate_and_memory, rotor
from paper.motor.runs import DURATION, SIGNIFICANT

FEW = 300
"""Flights below which no law is judged."""

ROTORS = 4
"""Number of rotors beside each motor, so that their error is smaller than the motor's."""

LOOKS = {
    "uniform": (style.BLUE, "o", "uniform temperature"),
    "factor 1": (style.PURPLE, "D", "uniform, ball and ring counted once"),
    "nonuniform": (style.ORANGE, "s", "nonuniform temperature"),
    "air at 2 mm/s": (style.GREEN, "^", "uniform, in air at 2 mm/s"),
    "air at 20 mm/s": (style.GREEN, "v", "uniform, in air at 20 mm/s"),
}
"""Color, marker and label of each ensemble."""


class Law(NamedTuple):
    """What is left of the flights of an ensemble, by each definition, and of those of rotors."""

    runs: int
    motor: dict[str, Remaining]
    rotor: dict[str, Remaining]
    """of `ROTORS` rotors beside each motor, for as long, with the ball's rate and memory"""
    measured: RateAndMemory
    """of the ball"""

    def excess(self, key: str) -> float:
        """Return by how many standard errors the motor's squared variation is above the rotor's."""
        motor, rotor = (laws[key].squared_variation for laws in (self.motor, self.rotor))
        return (motor[0] - rotor[0]) / float(np.hypot(motor[1], rotor[1]))


class Laws(NamedTuple):
    """The law of flights of each ensemble."""

    method: str
    found: dict[str, Law]


def compute(quick: bool) -> Laws:
    """Simulate the ensembles, and draw rotors beside each."""
    return Laws(METHOD, {name: _law(azimuths(name, quick).rows) for name in ENSEMBLES})


def _law(rows: list[NDArray[np.float64]]) -> Law:
    measured = rate_and_memory(rows, RECORD_INTERVAL)
    times = RECORD_INTERVAL * np.arange(max(map(len, rows)))
    rotors = [
        path[: len(row)]
        for seed in range(ROTORS)
        for path, row in zip(rotor(*measured, times, len(rows), seed), rows, strict=True)
    ]
    motor, null = (
        {key: remaining(paths, each) for key, each in DEFINITIONS.items()}
        for paths in (rows, rotors)
    )
    return Law(len(rows), motor, null, measured)


def claims(laws: Laws) -> list[Claim]:
    """Return the claims, all of which are ours."""
    return [_variation(LOOKS[name][2], law) for name, law in laws.found.items()]


def _variation(name: str, law: Law) -> Claim:
    """Judge by which definitions the motor's flights vary more than those of rotors."""
    excess = {key: law.excess(key) for key in DEFINITIONS}
    parts = [
        f"{each.label}: {_said(law.motor[key])}, rotor {_said(law.rotor[key])}, by"
        f" {excess[key]:.1f} standard errors"
        for key, each in DEFINITIONS.items()
    ]
    beyond = sum(each > SIGNIFICANT for each in excess.values())
    count = len(law.motor["once"].lasts)
    verdict: Verdict = "right" if beyond == len(excess) else "in part" if beyond else "wrong"
    return Claim(
        f"{OURS}whatever counts as a flight, flights vary more than those of a rotor without wells"
        f" ({name})",
        f"squared coefficient of variation of what is left of a flight: {'; '.join(parts)}. By"
        f" {beyond} of {len(excess)} definitions the motor's is larger by more than {SIGNIFICANT}"
        f" standard errors. {count} flights by the first definition in {law.runs} runs; rotors with"
        f" the ball's rate of {1e3 * law.measured.rate:.2f} mrad/s over 100 s and its memory of"
        f" {law.measured.memory:.0f} s",
        verdict if count >= FEW else "not decided",
    )


def _said(left: Remaining) -> str:
    value, error = left.squared_variation
    return f"{value:.2f} ± {error:.2f}"


def draw(laws: Laws, path: Path) -> None:
    """Draw the squared variation by each definition, and the survival of flights by the first."""
    with style.figure(12.5, 5.2) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
        rows = np.arange(len(DEFINITIONS))[::-1]
        for number, (name, (color, marker, label)) in enumerate(LOOKS.items()):
            height = rows + 0.3 - 0.15 * number
            for found, look in (
                (laws.found[name].motor, {"fmt": marker, "label": label}),
                (laws.found[name].rotor, {"fmt": "x", "alpha": 0.6}),
            ):
                values, errors = np.array([found[key].squared_variation for key in DEFINITIONS]).T
                left.errorbar(values, height, xerr=errors, color=color, ms=5, **look)
        left.plot([], [], "x", color=style.INK, label="rotor without wells beside each")
        left.axvline(1, color=style.GRAY, ls="--", lw=1.2)
        left.set_yticks(rows, [each.label.replace(", ", ",\n") for each in DEFINITIONS.values()])
        left.set(xlabel="squared coefficient of variation of what is left of a flight")
        left.set_title("1 if exponential (dashed); bars: standard error")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        uniform, air = laws.found["uniform"], laws.found["air at 20 mm/s"]
        for found, color, label in (
            (uniform.motor, LOOKS["uniform"][0], LOOKS["uniform"][2]),
            (air.motor, LOOKS["air at 20 mm/s"][0], LOOKS["air at 20 mm/s"][2]),
            (uniform.rotor, style.INK, "rotor, as at uniform temperature"),
        ):
            flights = found["once"]
            mean = flights.lasts.sum() / (~flights.censored).sum()
            times, survival = flights.survival
            right.plot(times / mean, survival, color=color, label=f"{label}: mean {mean:.0f} s")
        times = np.linspace(0, 7, 50)
        right.plot(times, np.exp(-times), color=style.GRAY, ls="--", label="exponential")
        right.set(
            xlabel="time after the first revolution / mean", xlim=(0, 7), yscale="log",
            ylabel="part of flights that last longer", ylim=(1e-3, 10),
            yticks=[1e-3, 1e-2, 1e-1, 1],
        )  # fmt: skip
        right.set_title("Flights by the first definition")
        right.legend(loc="upper right")
        style.save(figure, path, dpi=80)


FIGURE = Figure(
    "motor_flight_law",
    "Motor: the law of its flights, by definition",
    "How long a flight still lasts once it qualifies as a flight, by each of five definitions,"
    f" in runs of up to {DURATION:g} s (h = 0.4 s; nonuniform: nonuniform-a, h = 0.1 s). A"
    " *sector* is the angle between two wells. The rate is averaged over 200 s. Durations that"
    " the end of a run cuts off are censored; errors are by the jackknife over runs. Crosses:"
    " rotors without wells, Ornstein-Uhlenbeck processes with the ball's rate and memory,"
    f" {ROTORS} beside each motor and for as long, analyzed by the same code; their law is not"
    " exponential, either. In [the transport](#motor_transport), the squared coefficient of"
    " variation is 1.97 ± 0.06 for flights by the first definition, and 1.03 ± 0.02 for a"
    " rotor's: those runs are ten times as long, begin in equilibrium, and leave out the flights"
    " that their end cuts off. The drag of air is that at a speed of 2 mm/s, which the ball has,"
    " and at 20 mm/s, where it is 2.6 times as large.",
    compute,
    claims,
    draw,
    (),
    (METHOD,),
    undecided=tuple(range(len(LOOKS))),
)
