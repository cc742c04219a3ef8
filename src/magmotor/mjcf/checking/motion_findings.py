"""What swings or turns too fast for the timestep, or absurdly slowly, and lost spins."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np
from scipy.spatial.distance import cdist

from magmotor.mjcf.checking.closest_approach import Meeting
from magmotor.mjcf.checking.contact_rule import SLACK
from magmotor.mjcf.checking.failure import ABSURD, Failure, rounded_down
from magmotor.mjcf.checking.field_strengths import unbounded_drives
from magmotor.mjcf.checking.frequencies import frequency_at_touch, unstable_joints
from magmotor.mjcf.checking.gyroscopic import unkept_spin
from magmotor.mjcf.checking.pair_findings import (
    at_drive_1,
    names_of,
    stiffer,
    too_soft,
    unless_limited,
)
from magmotor.mjcf.checking.strengths import Magnet, magnets_of
from magmotor.mjcf.declared import can_move
from magmotor.mjcf.describe import Description
from magmotor.mjcf.lookup import INTEGRATORS, label
from magmotor.mjcf.unit_system import declares_units
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

UNSTABLE, RESOLVED = 2.0, 0.5
"""Product of frequency and timestep at which Euler's method fails, and that of a proposed step."""

FAR, FAINT, SLOW = 1e3, 1e-7, 2e-5
"""Distance of the nearest magnet over the size of one, from which positions are in other units than
sizes; polarization in T, from which sizes are in other units than moments; and the product of
frequency and timestep below which this is said."""

DAMPED = 0.5
"""Product from which RK4 damps swings, whose energy it lowers by (omega h)^6/72 in a step."""

CHAOTIC = 1.0
"""Product of frequency and timestep from which wide swings heat: a pendulum's map is chaotic.

Measured with Euler's method: the largest speed exceeds that of energy by 5 % at 0.8, 1.4 times at
1.0, and 17 times at 1.2.
"""

OF_DIPOLES = "move its dipoles apart", "since a moment, a field, a coil or a factor is too large"
OF_POTENTIALS = "reduce the user numbers of the joint", "since its user numbers are too large"
"""What to do if no timestep helps, and why a frequency overflows."""

STAGES = 4
"""How many times as much as one of Euler's a step of RK4 costs."""


def far_magnets(
    model: mujoco.MjModel, now: dict[int, float], state: mujoco.MjData, found: Description
) -> Iterator[Failure]:
    """Yield at most one failure, or note in a field: that lengths seem to be in other units."""
    slow = SLOW / float(model.opt.timestep)
    if declares_units(model) or not now or not all(0 < each < slow for each in now.values()):
        return
    magnets, slowest = magnets_of(model, state), max(now, key=lambda body: now[body])
    magnet = next(each for each in magnets if each.body == slowest and not each.images)
    size, nearest = _size_and_distance(model, magnets, magnet)
    polarization = VACUUM_PERMEABILITY * magnet.strengths.sum() / max(4 * size**3, 1e-300)
    far, other = FAR * size < nearest < math.inf, ""
    if nearest < math.inf:
        other = f"the nearest magnet is {nearest:.3g} m away, and "
    if size and (far or polarization < FAINT):
        felt = ["the other magnets"] * bool(other) + ["the applied fields"]
        yield Failure(
            label(model, "body", magnet.body),
            f"hardly feels {' and '.join(felt[: 1 + ('fields' in found.acting)])}: there, it swings"
            f" or turns at no more than {now[magnet.body]:.2g} rad/s, since {other}it has"
            f" {magnet.strengths.max():.3g} A m^2 and a radius of {size:.3g} m; are all lengths in"
            " meters?",
            len(now),
            note="fields" in found.acting,
        )


def wide_swings(model: mujoco.MjModel, now: dict[int, float]) -> Iterator[Failure]:
    """Yield at most one note: that wide swings may gain energy without bound, or lose it."""
    product = max(now.values(), default=0.0) * float(model.opt.timestep)
    what = (
        "small swings are stable up to 2, but wide ones that nothing damps gain energy from about 1"
        " on"
    )
    limit = CHAOTIC
    if model.opt.integrator == INTEGRATORS["RK4"]:
        limit = DAMPED
        steps = 72 / max(product, limit) ** 6
        what = f"RK4 takes a factor of e from the energy of such swings in {steps:.2g} steps"
    if limit < product <= UNSTABLE:
        fastest = max(now, key=lambda body: now[body])
        yield Failure(
            label(model, "body", fastest),
            f"has omega h = {product:.3g} at most: {what}",
            note=True,
        )


def scattered(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield at most one note: that all magnets are much too far apart to feel each other."""
    magnets = magnets_of(model, state)
    moving = [each for each in magnets if each.strengths.any() and can_move(model, each.body)]
    known = [(*_size_and_distance(model, magnets, magnet), magnet) for magnet in moving]
    if not known or declares_units(model):
        return
    if all(0 < FAR * size < nearest < math.inf for size, nearest, _ in known):
        size, nearest, magnet = min(known, key=lambda each: each[1] / each[0])
        yield Failure(
            "magnets",
            f"hardly feel each other, such as {label(model, 'body', magnet.body)} with a radius of"
            f" {size:.3g} m, {nearest:.3g} m away from the nearest one: are all lengths in meters?",
            note=True,
        )


def _size_and_distance(
    model: mujoco.MjModel, magnets: list[Magnet], magnet: Magnet
) -> tuple[float, float]:
    """Return the radius of a magnet, and its distance from the nearest other one or from iron.

    The distance is infinite without any, and 0 with a plane of iron.
    """
    geoms = model.body_weldid[model.geom_bodyid] == magnet.body
    others = [each for each in magnets if each.body != magnet.body]
    nearest = min(
        (cdist(magnet.positions, each.positions).min() for each in others), default=np.inf
    )
    planes = any(each.images for each in others)
    return float(model.geom_rbound[geoms].max(initial=0)), 0.0 if planes else float(nearest)


def fast_magnets(
    model: mujoco.MjModel, now: dict[int, float], state: mujoco.MjData, pairs: list[Meeting]
) -> Iterator[Failure]:
    """Yield a failure of the fastest magnet now, and one of each pair at touch, if too fast."""
    found = []
    if now:
        fastest = max(now, key=lambda body: (now[body], label(model, "body", body)))
        assumed = _assumed(model, state, fastest)
        found.append((now[fastest], label(model, "body", fastest), 1, assumed, None))
    for pair in pairs:
        nearest = " where their joints let them come nearest"
        nearest += unless_limited(model, pair) + too_soft(model, pair)
        for approach, where in ((pair.approach, " where they touch"), (pair.linked, nearest)):
            if approach:
                frequency = frequency_at_touch(model, state, pair.magnets, approach)
                known = max(now.get(magnet.body, 0) for magnet in pair.magnets)
                where += at_drive_1(model, {magnet.unbounded for magnet in pair.magnets})
                if approach is pair.approach or frequency > SLACK * known:
                    limit = pair.soft_limit if approach is pair.linked else None
                    found.append((frequency, names_of(model, pair), pair.number, where, limit))
    step = float(model.opt.timestep)
    for frequency, name, number, where, limit in found:
        cure = stiffer(model, limit) if limit else ""
        yield from _too_fast(step, frequency, name, number, where, *OF_DIPOLES, cure)


def fast_joints(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield a failure of each joint that swings too fast in its periodic potential."""
    step = float(model.opt.timestep)
    for joint, frequency in unstable_joints(model, state).items():
        name = label(model, "joint", joint)
        yield from _too_fast(step, frequency, name, 1, " in its potential", *OF_POTENTIALS)


def _too_fast(
    step: float,
    frequency: float,
    name: str,
    number: int,
    where: str,
    remedy: str,
    cause: str,
    cure: str = "",
) -> Iterator[Failure]:
    """Yield at most one failure: that a frequency is too high for the timestep.

    `remedy` is what helps where no timestep does, and `cure` what to do instead of a shorter one.
    """
    if frequency == math.inf:
        yield Failure(
            name,
            f"would turn or swing{where} so fast that its frequency overflows, {cause}"
            + f"; {cure}" * bool(cure),
            number,
        )
    elif frequency * step > UNSTABLE:
        longest = rounded_down(RESOLVED / frequency)
        if cure or longest < ABSURD * step:
            longest, remedy = math.inf, cure or remedy
        else:
            remedy = f"take a timestep of at most {longest:g} s"
        yield Failure(
            name,
            f"can swing or turn with omega = {frequency:.3g} rad/s at most{where}, so that"
            f" omega h = {frequency * step:.3g} exceeds 2; {remedy}",
            number,
            longest,
        )


def _assumed(model: mujoco.MjModel, state: mujoco.MjData, body: int) -> str:
    """Say which drives of coils, and of fields that act on a body, are taken at 1."""
    coils = {magnet.unbounded for magnet in magnets_of(model, state)}
    return at_drive_1(model, coils | unbounded_drives(model, state, body))


def unkept_spins(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield at most one failure: a spin that the integrator does not keep."""
    spin = unkept_spin(model, state)
    if not spin:
        return
    step, shorter = float(model.opt.timestep), rounded_down(spin.timestep)
    least = ABSURD * step
    with_rk4 = step if spin.of_rk4 == step else rounded_down(spin.of_rk4)
    remedies = [f"a timestep of at most {shorter:g} s"] if shorter > least else []
    if with_rk4 > least and spin.integrator != "RK4":
        also = f" with a timestep of at most {with_rk4:g} s," if with_rk4 < step else ""
        remedies.insert(0, f"the integrator RK4{also}")
    cheaper = spin.integrator != "RK4" and with_rk4 > max(least, STAGES * shorter)
    timestep = with_rk4 if cheaper else shorter
    remedy = " or ".join(remedies).removesuffix(",") or "a shorter timestep"
    change, why = "grows", "is explicit in gyroscopic forces"
    what = "angular momentum, as it tumbles," if spin.tumbles else "wobble"
    if spin.rate < 0:
        change, why = "decays", "damps it, so that a torque can tip the body"
    yield Failure(
        label(model, "body", spin.body),
        f"{spin.verb} at {spin.speed:.3g} rad/s{spin.where}, and its {what} {change} by a factor"
        f" of e within {1 / abs(spin.rate):.2g} s, since the integrator {spin.integrator} {why};"
        f" take {remedy}",
        spin.number,
        timestep if timestep > least else math.inf,
        integrator="RK4" if cheaper else "",
    )
