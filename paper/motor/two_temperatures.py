"""A motor with a chiral ring between two temperatures: heat, entropy, current and load."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.motor.scene import Motor
from paper.figure import OURS, Claim, Figure, judged
from paper.motor.long_runs import Size
from paper.motor.runs import until_tipping
from paper.motor.spreading import Measured, over_replicas
from paper.motor.work_picture import draw_temperatures

METHOD = "variational/middle"

TIMESTEP = 0.2
"""In s."""

RECORDS = 10.0
"""Time between two records, in s."""

SIZE = {False: Size(64, 6e4, 1e4), True: Size(8, 9e3, 1e3)}

MORE_ALIKE = 4
"""Times as many replicas at one temperature, where both laws want zeros."""

UNTIL_IT_TIPS = Size(64, 8e3, 2e3)
"""Of the paper's motor, whose ring nothing cools."""

CHIRALITY = 0.8
"""Angle of the inner dipoles, in rad."""

FRICTION = 0.015
"""Friction of the ring in kg m^2/s: a tenth of the paper's, so that less noise hides the heat."""

RATIOS = {False: (0.25, 1.0, 4.0, 8.0), True: (0.25, 1.0, 8.0)}
"""Temperatures of the ring in units of the ball's."""

LOAD = 1e-7
"""In N m."""

SIGNIFICANT = 4
"""Standard errors of a significant difference."""


class Flow(NamedTuple):
    """Means over time of R replicas."""

    heat: Array
    """from the ring's bath, in W, shape (R,)"""
    taken: Array
    """heat into the ball's bath, in W, shape (R,)"""
    speed: Array
    """of the ball's azimuth, in rad/s, shape (R,)"""
    rate: float
    """root mean square of the azimuth's rate, in rad/s"""


@dataclass(frozen=True)
class TwoTemperatures:
    """Data of the figure."""

    method: str
    kT: float
    """of the ball, in J"""
    ratios: tuple[float, ...]
    """temperatures of the ring in units of the ball's"""
    flows: tuple[Flow, ...]
    """at each ratio"""
    mirrored: Flow
    """at the last ratio, with the opposite chirality"""
    loaded: tuple[Flow, Flow]
    """at the last ratio, under the loads -LOAD and LOAD"""
    paper: tuple[Flow, Flow]
    """of the paper's motor at nonuniform temperature, under the same loads"""

    @property
    def heats(self) -> Measured:
        """Heat from ring to ball at each ratio, in W."""
        return _each([flow.heat for flow in self.flows])

    @property
    def entropies(self) -> Measured:
        """Heat from the ring's bath times 1/kT_ball - 1/kT_ring at each ratio, in 1/s."""
        per_heat = (1 - 1 / np.array(self.ratios)) / self.kT
        return Measured(self.heats.value * per_heat, self.heats.error * np.abs(per_heat))

    @property
    def conductance(self) -> Measured:
        """Heat per difference of the two temperatures in units of the ball's, in W.

        The weights of the ratios are those of least error.
        """
        apart = [(r - 1, f) for r, f in zip(self.ratios, self.flows, strict=True) if r != 1]
        each = np.stack([flow.heat / difference for difference, flow in apart], axis=1)
        weight = 1 / each.var(axis=0)
        return over_replicas(each @ weight / weight.sum())

    @property
    def arrives(self) -> Measured:
        """Heat into the ball's bath at the last ratio, in W."""
        return over_replicas(self.flows[-1].taken)

    @property
    def speeds(self) -> Measured:
        """Mean speed at each ratio, in rad/s."""
        return _each([flow.speed for flow in self.flows])

    @property
    def loads(self) -> list[tuple[float, Flow]]:
        """All loads in N m, and what they do."""
        return [(sign * LOAD, flow) for pair in (self.loaded, self.paper)
                for sign, flow in zip((-1, 1), pair, strict=True)]  # fmt: skip

    @property
    def mobility(self) -> float:
        """Speed over torque at the last ratio, in rad/(N m s)."""
        minus, plus = self.loaded
        return float(plus.speed.mean() - minus.speed.mean()) / (2 * LOAD)

    def stall(self, current: float) -> float:
        """Return the torque in N m that stops a current in rad/s."""
        return current / self.mobility

    def efficiency(self, current: float) -> float:
        """Return the largest output of a current in rad/s, under half the torque that stops it.

        It is relative to the heat at the last ratio.
        """
        return float(self.stall(current) * current / 4 / self.heats.value[-1])

    @property
    def current(self) -> Measured:
        """The part of the speed at the last ratio that changes its sign with the chirality."""
        return over_replicas((self.flows[-1].speed - self.mirrored.speed) / 2)


def scene_of(ratio: float, angle: float = CHIRALITY, load: float = 0.0) -> Motor:
    """Return a motor with ten inner dipoles, and a ring of `ratio` times the ball's temperature."""
    return Motor(
        temperature="nonuniform", inner_dipoles=10, inner_dipole_angle=angle, load_torque=load,
        alpha_ball=1e-3, friction_ring=FRICTION,
        alpha_ring=math.sqrt(2 * FRICTION * ratio * Motor().kT),
    )  # fmt: skip


def flow_of(scene: Motor, size: Size, seed: int) -> Flow:
    """Simulate replicas of a motor, until a ring tips, and omit the burn-in."""
    run = until_tipping(
        scene, method=METHOD, timestep=TIMESTEP, duration=size.duration, replicas=size.replicas,
        record_interval=round(RECORDS / TIMESTEP), seed=seed,
    )  # fmt: skip
    run = run.sel(time=slice(size.burn_in, None))
    span = float(run.time[-1] - run.time[0])
    x, y = np.moveaxis(run.position.values[..., :2], -1, 0)
    azimuth = np.unwrap(np.arctan2(y, x), axis=1)
    given = _growth((run.ring_work - run.ring_heat).values) / span
    ball_takes = (run.heat - run.ring_heat) - (run.work - run.ring_work)
    # Over a minute, the thermal motion within a valley averages out.
    minute = round(60.0 / RECORDS)
    steps = np.diff(azimuth[:, ::minute], axis=1) / (minute * RECORDS)
    return Flow(
        given,
        _growth(ball_takes.values) / span,
        _growth(azimuth) / span,
        float(np.sqrt(np.mean(steps**2))),
    )


def _growth(column: Array) -> Array:
    return column[:, -1] - column[:, 0]


def _each(columns: list[Array]) -> Measured:
    """Return means and errors of several samples."""
    value, error = np.array([over_replicas(column) for column in columns]).T
    return Measured(value, error)


def compute(quick: bool) -> TwoTemperatures:
    """Simulate motors at several temperatures of the ring, then with the mirror image and loads."""
    size, ratios = SIZE[quick], RATIOS[quick]
    short = size._replace(duration=size.duration / 3)
    many = size._replace(replicas=MORE_ALIKE * size.replicas)
    flows = [
        flow_of(scene_of(ratio), many if ratio == 1 else size, seed)
        for seed, ratio in enumerate(ratios)
    ]
    mirrored = flow_of(scene_of(ratios[-1], -CHIRALITY), size, 10)
    (minus, plus), (paper_minus, paper_plus) = (
        [flow_of(scene.replace(load_torque=load), length, 20) for load in (-LOAD, LOAD)]
        for scene, length in (
            (scene_of(ratios[-1]), short),
            (Motor.paper("nonuniform-a"), UNTIL_IT_TIPS._replace(replicas=size.replicas)),
        )
    )
    return TwoTemperatures(
        METHOD, Motor().kT, ratios, tuple(flows), mirrored, (minus, plus), (paper_minus, paper_plus)
    )


def claims(data: TwoTemperatures) -> list[Claim]:
    """Judge both laws of thermodynamics and the current of the chiral ring."""
    heats, entropies, speeds, current = data.heats, data.entropies, data.speeds, data.current
    one, conductance = data.ratios.index(1.0), data.conductance
    produced = "; ".join(
        f"{_tens(entropies.value[k], entropies.error[k])} k/s at {ratio:g}"
        for k, ratio in enumerate(data.ratios)
        if k != one
    )
    sure = float(conductance.value / conductance.error)
    arrives, apart = data.arrives, data.arrives.value - heats.value[-1]
    apart_error = np.hypot(arrives.error, heats.error[-1])
    rate, largest = data.flows[-1].rate, float(abs(current.value) + SIGNIFICANT * current.error)
    outputs = [over_replicas(-load * flow.speed) for load, flow in data.loads]
    lifts = max(float(each.value / each.error) for each in outputs)
    return [
        judged(
            f"{OURS}heat flows from hot to cold, so that entropy is produced",
            f"{_tens(conductance.value, conductance.error)} W for each of the ball's temperatures"
            f" between ring and ball, {sure:.0f} standard errors above 0. At {data.ratios[-1]:g}"
            " times the ball's temperature the ring's bath gives"
            f" {_tens(heats.value[-1], heats.error[-1])} W and the ball's takes"
            f" {_tens(arrives.value, arrives.error)} W. The first heat times 1/kT_ball - 1/kT_ring"
            f" is {produced} times the ball's temperature",
            sure > SIGNIFICANT and _not_below(entropies) and _is_zero(apart, apart_error),
        ),
        judged(
            f"{OURS}at one temperature no heat flows between ring and ball",
            f"{_tens(heats.value[one], heats.error[one])} W"
            f" {_zero(heats.value[one], heats.error[one])}",
            _is_zero(heats.value[one], heats.error[one]),
        ),
        judged(
            f"{OURS}at one temperature a chiral ring drives no current",
            f"mean speed {_tens(speeds.value[one], speeds.error[one])} rad/s"
            f" {_zero(speeds.value[one], speeds.error[one])}, of"
            f" {data.flows[one].rate:.1e} rad/s rms ({len(data.flows[one].speed)} replicas)",
            _is_zero(speeds.value[one], speeds.error[one]),
        ),
        judged(
            f"{OURS}between two temperatures, too, no current of a chiral ring is found",
            "the part of the speed that changes its sign with the chirality is"
            f" {_tens(current.value, current.error)} rad/s"
            f" {_zero(current.value, current.error)} at {data.ratios[-1]:g} times the ball's"
            f" temperature, at most {largest / rate:.0%} of {rate:.1e} rad/s rms (bound of"
            f" {SIGNIFICANT} standard errors)",
            _is_zero(current.value, current.error) and largest < rate / 2,
        ),
        judged(
            f"{OURS}between two temperatures the motor does not lift a load of {LOAD:g} N m, with a"
            " ring of one chirality or with the paper's at nonuniform temperature",
            "output with the load in either direction, and no other load was tried:"
            f" {' and '.join(_tens(each.value, each.error) for each in outputs[:2])} W, of the"
            f" paper's motor {' and '.join(_tens(each.value, each.error) for each in outputs[2:])}"
            f" W; a current of the chiral ring within the bound would be stopped by"
            f" {data.stall(largest):.0e} N m, and deliver at most {data.efficiency(largest):.0e} of"
            " the heat",
            lifts < SIGNIFICANT,
        ),
    ]


def _is_zero(value: Array, error: Array) -> bool:
    return bool(np.abs(value) < SIGNIFICANT * error)


def _not_below(found: Measured) -> bool:
    return bool(np.all(found.value >= -SIGNIFICANT * found.error))


def _zero(value: Array, error: Array) -> str:
    """Return how far a number is from zero, beside the bound."""
    return f"({abs(value) / error:.1f} standard errors from 0; bound {SIGNIFICANT})"


def _tens(value: Array, error: Array) -> str:
    """Return a number with its error in powers of ten."""
    exponent = math.floor(math.log10(max(abs(float(value)), float(error))))
    scale = 10.0**exponent
    return f"({value / scale:.2f} ± {error / scale:.2f})e{exponent}"


FIGURE = Figure(
    name="motor_two_temperatures",
    title="A chiral ring between two temperatures: heat flows, but nothing is lifted",
    caption="The inner ring has ten dipoles, each turned away from the radial direction by 0.8"
    " rad, so the potential of the ball differs from its mirror image; kT of the ball is"
    " the paper's at alpha = 1e-3, and c_R = 0.015. Left: the heat from the ring's bath,"
    " by friction and noise of the ring, and this heat times 1/kT_ball - 1/kT_ring, the"
    " entropy that it produces. Middle: mean speed of the ball for both chiralities, and"
    " its rms over a minute. Right: speed under a load, also for the paper's motor at"
    " nonuniform temperature (a ring with 20 radial dipoles, alpha = 2e-4). Bars are"
    " standard errors over the replicas.",
    compute=compute,
    claims=claims,
    draw=draw_temperatures,
    methods=(METHOD,),
    undecided=(0, 3),
)
