"""Pairs of magnets whose contacts are too weak, or whose dipoles come too near."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np

from magmotor.mjcf.checking.close_iron import CloseIron
from magmotor.mjcf.checking.closest_approach import Meeting
from magmotor.mjcf.checking.contact_rule import (
    SHORTEST,
    SLACK,
    Approach,
    Softness,
    longest_time_constant,
    owners_of,
    penetration_at_rest,
    shortest_kept,
    softness,
)
from magmotor.mjcf.checking.failure import ABSURD, Failure, rounded_down
from magmotor.mjcf.checking.impact import deepest_impact
from magmotor.mjcf.checking.joint_limits import SoftLimit
from magmotor.mjcf.checking.reach import equality_is_between
from magmotor.mjcf.checking.swept import turns_left_out
from magmotor.mjcf.lookup import label

COARSE = 0.8
"""Distance of dipoles at touch, over that within their layouts, below which these are too strong.

A rule of thumb: measured at touch, layouts above it have up to 3.9 times the force of the magnets,
and those below it 1.6 to 70 times; see docs/contact.md.
"""


def failures_of_pair(model: mujoco.MjModel, pair: Meeting) -> Iterator[Failure]:
    """Yield what will fail where two magnets come near each other."""
    if pair.exposed:
        yield _exposure(model, pair)
    if pair.approach and not pair.repels:
        yield from _weak_contacts(model, pair, pair.approach)
    laid_out = any((magnet.elements < model.nsite).any() for magnet in pair.magnets)
    spacing = pair.spacing if laid_out and not pair.repels else None
    if spacing and spacing.apart < COARSE * spacing.within:
        yield _coarseness(model, pair, *spacing)
    if pair.close_iron:
        yield _close_iron(model, pair, pair.close_iron)


def _close_iron(model: mujoco.MjModel, pair: Meeting, found: CloseIron) -> Failure:
    geoms, can, remedy = [found.one, found.other], "can touch", "a margin keeps them apart"
    if not found.touch:
        can, remedy = "may come near each other", "keep them farther apart"
    elif not len(pair.touching):
        can, remedy = "can come near each other", "let them collide, with a margin"
    if found.excluded:
        remedy = "the model excludes their contact, so that nothing keeps them apart"
    return Failure(
        " and ".join(label(model, "geom", geom) for geom in geoms),
        f"are pieces of iron that {can}, where the force between them is rough, since the gap is"
        f" narrower than the distance of the nodes on their surfaces; {remedy}, or give their"
        " material a smaller distance of nodes",
        pair.number,
        note=found.excluded,
    )


def _exposure(model: mujoco.MjModel, pair: Meeting) -> Failure:
    by_geom = all((magnet.elements >= model.nsite).all() for magnet in pair.magnets)
    center = "center of a magnet" if by_geom else "dipole"
    why = f"a {center} is on or outside the surface of its body's colliding geoms"
    if not len(pair.touching):
        why = "no geoms of theirs collide"
    remedy = f"let geoms that enclose {'them' if by_geom else 'the dipoles'} collide"
    if pair.soft_limit:
        why += f" and the limit of {label(model, 'joint', pair.soft_limit.joint)} is too soft"
        remedy = f"{stiffer(model, pair.soft_limit)}, or {remedy}"
    where = f"their {'centers' if by_geom else 'dipoles'} coincide"
    where = f"a {center} is in the plane of iron" if _has_plane(pair) else where
    return Failure(
        names_of(model, pair),
        f"can come so near that {where}{unless_limited(model, pair)}, since {why}; {remedy}",
        pair.number,
    )


def _coarseness(model: mujoco.MjModel, pair: Meeting, apart: float, within: float) -> Failure:
    partners = "their images" if _has_plane(pair) else "each other"
    return Failure(
        names_of(model, pair),
        "attract each other too strongly in poses in which they touch: there, dipoles are"
        f" {apart:.2g} m from {partners}, and each stands for a piece of up to {within:.2g} m;"
        " take a layout such as mm.magnet's for error=0.5 and a gap of 0.3 times its thickness or,"
        " if it is longer than wide, of 0.4 times its width",
        pair.number,
    )


def _weak_contacts(model: mujoco.MjModel, pair: Meeting, approach: Approach) -> Iterator[Failure]:
    """Yield at most one failure: that of the weakest contact of two magnets."""
    step = float(model.opt.timestep)
    shortest = shortest_kept(model, step)
    contacts = [softness(model, *row) for row in pair.touching.tolist()]
    contacts = [each._replace(cone=each.cone / approach.contacts) for each in contacts]
    limits = [longest_time_constant(approach, contact) for contact in contacts]
    given = [contact.stiffness_time(shortest) for contact in contacts]
    k = int(np.divide(given, limits).argmax())
    longest = min(contact.resolved_time(shortest) for contact in contacts) / SHORTEST
    if given[k] > SLACK * limits[k]:
        constant = rounded_down(min(limits))
        long = 0 < contacts[k].solref[0] < shortest
        lengthened = f" (as the timestep of {step:g} s makes it)" if long else ""
        half = rounded_down(constant / SHORTEST)
        bound = "at most" if pair.exact else "up to about"
        if half < ABSURD * step:
            yield _exposure(model, pair)
            return
        yield Failure(
            names_of(model, pair),
            f"{_outcome(pair, approach, contacts[k], given[k], step, shortest)}: where they touch,"
            f" they attract each other with {bound} {approach.pull:.3g} N{_assumed(model, pair)};"
            f" the time constant of their contact should be at most {constant:g} s, not"
            f" {given[k]:.3g} s{lengthened}"
            + (f", and the timestep at most {half:g} s" if step > half else ""),
            pair.number,
            half,
            constant,
            owners_of(model, pair.like),
        )
    elif step > SLACK * longest:
        shorter = rounded_down(longest)
        yield Failure(
            names_of(model, pair),
            f"meet in a contact that moves within {SHORTEST * longest:.3g} s; take a timestep of at"
            f" most {shorter:g} s, not {step:g} s",
            pair.number,
            shorter,
        )


def _assumed(model: mujoco.MjModel, pair: Meeting) -> str:
    """Say which coils are taken at a drive that nothing bounds, and which limit is too soft."""
    return at_drive_1(model, {magnet.unbounded for magnet in pair.magnets}) + too_soft(model, pair)


def too_soft(model: mujoco.MjModel, pair: Meeting) -> str:
    """Say which limit is too soft, if one is."""
    name = label(model, "joint", pair.soft_limit.joint) if pair.soft_limit else ""
    return f" (the limit of {name} is too soft to keep them apart)" * bool(name)


def stiffer(model: mujoco.MjModel, limit: SoftLimit) -> str:
    """Say how stiff a limit must be, and which timestep that needs."""
    said = f'give {label(model, "joint", limit.joint)} solreflimit="{limit.constant:g} 1"'
    shorter = model.opt.timestep > limit.timestep
    return said + f" and take a timestep of at most {limit.timestep:g} s" * shorter


def at_drive_1(model: mujoco.MjModel, actuators: set[int]) -> str:
    """Say which actuators are taken at drive 1, since nothing bounds them; -1 stands for none."""
    names = {label(model, "actuator", actuator) for actuator in actuators - {-1}}
    return f" (at drive 1 of {' and '.join(sorted(names))}, which nothing bounds)" if names else ""


def _outcome(
    pair: Meeting,
    approach: Approach,
    contact: Softness,
    constant: float,
    step: float,
    shortest: float,
) -> str:
    """Say what will happen where a contact is too soft."""
    rest = penetration_at_rest(approach, contact, constant)
    apart = "fly apart or fall through" if _has_plane(pair) else "fly apart"
    if rest == math.inf:
        return f"{'will' if pair.exact else 'may'} {apart} once they touch"
    deepest = max(rest, deepest_impact(approach, contact, constant, step))
    resolved = step <= SLACK * contact.resolved_time(shortest) / SHORTEST
    if deepest == math.inf or not resolved:
        return f"may {apart} if they meet at speed"
    percent = 100 * approach.distance / approach.depth
    center = "a magnet's center" if any(each.shaped for each in pair.magnets) else "a dipole"
    by, unit = ("by", "their radius") if pair.exact else ("by up to", f"the depth of {center}")
    return (
        f"will stick once they touch, but penetrate each other {by} {rest * percent:.2g} % of"
        f" {unit} at rest, and by up to {math.ceil(deepest * percent)} % as they meet"
    )


def _has_plane(pair: Meeting) -> bool:
    return pair.magnets[1].images != 0


def unless_limited(model: mujoco.MjModel, pair: Meeting) -> str:
    """Say what is left out and may keep two magnets apart: equalities, some limits of turns."""
    one, other = (magnet.body for magnet in pair.magnets)
    causes = ["equality constraints"] if equality_is_between(model, one, other) else []
    if turns_left_out(model, one, other):
        causes.append("the limits of their hinges or ball joints")
    return f" unless {' or '.join(causes)} keep them apart" if causes else ""


def names_of(model: mujoco.MjModel, pair: Meeting) -> str:
    """Return the names of two magnets, as the subject of a sentence."""
    names = [each.name(model, n) for each, n in zip(pair.magnets, pair.nearest, strict=True)]
    if all(name.startswith("body '") for name in names):
        return f"bodies {names[0][5:]} and {names[1][5:]}"
    return " and ".join(names)
