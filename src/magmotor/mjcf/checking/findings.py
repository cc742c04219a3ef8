"""What will fail in a model with magnets, one sentence each, and the settings without it."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from magmotor.common.arrays import Array
from magmotor.mjcf import declared
from magmotor.mjcf.checking.applied_fields import bent_fields
from magmotor.mjcf.checking.closest_approach import Meeting, meetings
from magmotor.mjcf.checking.contact_rule import (
    SHORTEST,
    SLACK,
    SUNK,
    Approach,
    Softness,
    longest_time_constant,
    owners_of,
    penetration_at_rest,
    shortest_kept,
    softness,
)
from magmotor.mjcf.checking.frequencies import frequencies, frequency_at_touch
from magmotor.mjcf.checking.geoms import contact_margin, touching_geoms
from magmotor.mjcf.checking.gyroscopic import unkept_spin
from magmotor.mjcf.checking.impact import deepest_impact
from magmotor.mjcf.checking.strengths import magnets_of
from magmotor.mjcf.declared import with_kind
from magmotor.mjcf.describe import SKIPPED, Description, described, weighed
from magmotor.mjcf.field_and_energy import magnetic_energy
from magmotor.mjcf.langevin.temperature import MATCH
from magmotor.mjcf.lookup import disabled, label
from magmotor.mjcf.unit_system import is_si
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

UNSTABLE, RESOLVED = 2.0, 0.5
"""Product of frequency and timestep at which Euler's method fails, and that of a proposed step."""

ABSURD = 1e-6
"""Timestep, over that of the model, below which none is proposed."""

COARSE = 0.8
"""Distance of dipoles at touch, over that within their layouts, below which these are too strong.

A rule of thumb: measured at touch, layouts above it have up to 3.9 times the force of the magnets,
and those below it 1.6 to 70 times; see docs/contact.md.
"""

WEAK = 1.0
"""Susceptibility below which pieces of iron that touch hardly magnetize each other."""

ROW = 4
"""Number of pieces of iron in a row from which the force is wrong: cubes, by 1.3 times."""

NEAR = 0.5
"""Gap of two pieces of iron, over the smaller radius, from which one dipole describes each."""

FAR, FAINT, SLOW = 1000.0, 1e-7, 2e-5
"""Distance of the nearest magnet over the size of one, from which positions are in other units than
sizes; polarization in T, from which sizes are in other units than moments; and the product of
frequency and timestep below which this is said."""

BENT = 0.3
"""Largest part of the force on a slender piece of weak iron in an applied field that may err."""


STAGES = 4
"""How many times as much as one of Euler's a step of RK4 costs."""


class Failure(NamedTuple):
    """One finding, and the settings without it."""

    subject: str
    predicate: str
    number: int = 1
    """Number of subjects like this one."""
    timestep: float = math.inf
    constant: float = math.inf
    """Time constant of contacts."""
    owners: tuple[tuple[str, Array], ...] = ()
    """What has the parameters of these contacts: name and numbers."""
    integrator: str = ""
    """The integrator without it, if that is the cheaper remedy."""


def failures(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield what will fail in a state, whose positions and contacts are up to date."""
    description = described(model)
    pairs, misplaced = [*meetings(model, state)], [*_misplaced(model, state)]
    yield from _idleness(model, description)
    yield from _skipped(model, description)
    yield from _huge(description)
    yield from misplaced
    yield from _overlaps(model, state)
    yield from _rows_of_iron(model, state)
    yield from _iron_that_touches(model, state, description)
    yield from _long_pieces(model, state) if not misplaced else ()
    for pair in pairs:
        if pair.exposed:
            yield _exposure(model, pair)
        if pair.approach:
            yield from _weak_contacts(model, pair, pair.approach)
        if pair.spacing and pair.spacing.apart < COARSE * pair.spacing.within:
            yield _coarseness(model, pair, *pair.spacing)
        if pair.wide >= 0:
            yield Failure(
                label(model, "geom", pair.wide),
                "of iron reaches farther from its center than the nearest dipole can be, so that"
                " one dipole does not describe it, and the force is wrong there, often many times"
                " too strong or too weak; for a wide surface that is fixed to the world, take a"
                " plane of iron",
            )
    now = {} if misplaced else frequencies(model, state)
    yield from _far_magnets(model, now, state, description)
    yield from _fast_magnets(model, now, state, pairs)
    yield from _unkept_spins(model, state)
    yield from _noise(description)


def _idleness(model: mujoco.MjModel, found: Description) -> Iterator[Failure]:
    """Yield at most one failure: that nothing acts on a model which has what should."""
    if found.idle and not found.acting and (found.marked or found.plugin or model.nuser_site):
        yield Failure("nothing", f"acts on this model. Not acting: {'; '.join(found.idle)}")


def _skipped(model: mujoco.MjModel, found: Description) -> Iterator[Failure]:
    """Yield at most one failure: that a flag disables the callback on which the forces depend."""
    if found.acting and not found.plugin and disabled(model, "actuation"):
        yield Failure(
            "magnetism()",
            f"does nothing, {SKIPPED}: enable the flag, or let the plugin magmotor.forces act",
        )


def _huge(found: Description) -> Iterator[Failure]:
    """Yield moments that are probably mistakes."""
    for site, moment in found.huge.items():
        yield Failure(with_kind("site", site), f"has {moment:g} A m^2, {weighed(moment)}")


def _misplaced(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield at most one dipole that is where its force is undefined."""
    try:
        magnetic_energy(model, state)
    except ValueError as error:
        yield Failure(str(error), "(in the state given)")


def _overlaps(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield geoms of magnets that overlap by more than contacts should allow."""
    magnets = magnets_of(model, state)
    bodies = [magnet.body for magnet in magnets if not magnet.images]
    planes = [magnet.elements[0] - model.nsite for magnet in magnets if magnet.images]
    welds = model.body_weldid[model.geom_bodyid]
    magnetic = np.isin(welds, bodies) | np.isin(np.arange(model.ngeom), planes)
    for contact in state.contact:
        geoms = contact.geom
        if (geoms < 0).any() or not magnetic[geoms].all():
            continue
        radii = model.geom_rbound[geoms]
        if -contact.dist > SUNK * radii[radii > 0].min():
            names = " and ".join(label(model, "geom", geom) for geom in geoms)
            yield Failure(
                names, f"of magnets overlap by {-contact.dist:.2g} m at the start; move them apart"
            )


def _rows_of_iron(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield rigid bodies in which pieces of iron touch in a row."""
    for magnet in magnets_of(model, state):
        geoms = magnet.elements[magnet.responses > 0] - model.nsite
        geoms = geoms[model.geom_type[geoms] != mujoco.mjtGeom.mjGEOM_SPHERE].tolist()
        touching = np.zeros((len(geoms), len(geoms)))
        places, radii = state.geom_xpos[geoms], model.geom_rbound[geoms]
        apart = np.linalg.norm(places[:, np.newaxis] - places, axis=2)
        for i, j in np.argwhere(np.triu(apart < 1.1 * np.add.outer(radii, radii), 1)).tolist():
            one, other = geoms[i], geoms[j]
            near = float(SUNK * model.geom_rbound[[one, other]].min())
            touching[i, j] = mujoco.mj_geomDistance(model, state, one, other, near, None) < near
        _, rows = connected_components(touching, directed=False)
        for row in np.flatnonzero(np.bincount(rows, minlength=1) >= ROW):
            own = np.flatnonzero(rows == row)
            yield Failure(
                label(model, "geom", geoms[own[0]]),
                f"and {len(own) - 1} other pieces of iron of its body touch, and magnetize each"
                " other too strongly; make them one geom",
            )


def _iron_that_touches(
    model: mujoco.MjModel, state: mujoco.MjData, found: Description
) -> Iterator[Failure]:
    """Yield at most one failure: of pieces of iron on different bodies that may touch."""
    if "iron" not in found.acting:
        return
    strong = np.zeros(model.ngeom, bool)
    chosen = [geom for geom, value in declared.iron(model).items() if value >= WEAK]
    strong[chosen] = model.geom_type[chosen] != mujoco.mjtGeom.mjGEOM_PLANE
    rows = touching_geoms(model)
    rows = rows[strong[rows[:, :2]].all(axis=1)]
    ends = rows[:, :2]
    joints = model.body_jntadr[model.body_weldid[model.geom_bodyid[ends]]]
    free = (joints >= 0) & (model.jnt_type[joints] == mujoco.mjtJoint.mjJNT_FREE)
    radii = model.geom_rbound[ends]
    places = state.geom_xpos[ends]
    gaps = np.linalg.norm(places[:, 0] - places[:, 1], axis=1) - radii.sum(axis=1)
    near = NEAR * radii.min(axis=1)
    rows = rows[free.any(axis=1) | (gaps < near)]
    margins = np.array([contact_margin(model, *row) for row in rows.tolist()])
    rows = rows[margins < NEAR * model.geom_rbound[rows[:, :2]].min(axis=1)]
    if len(rows):
        spheres = (model.geom_type[rows[0, :2]] == mujoco.mjtGeom.mjGEOM_SPHERE).all()
        of_spheres = (
            ": at 2.1 radii, the true force of two equal spheres is 2.8 times as strong along the"
            " field, and 0.75 times across it; with a margin of a quarter of the radius for each,"
            " 1.25 and 0.89 times"
            if spheres
            else ""
        )
        yield Failure(
            " and ".join(label(model, "geom", geom) for geom in rows[0, :2]),
            "are pieces of iron that can touch, where one dipole each does not describe them; a"
            f" margin keeps them apart{of_spheres}",
            len(rows),
        )


def _far_magnets(
    model: mujoco.MjModel, now: dict[int, float], state: mujoco.MjData, found: Description
) -> Iterator[Failure]:
    """Yield at most one failure: that lengths seem to be in other units than meters."""
    if (
        not is_si(model)
        or "dipoles" not in found.acting
        or {*found.acting} & {"fields", "iron", "coils"}
    ):
        return
    magnets = [magnet for magnet in magnets_of(model, state) if magnet.strengths.any()]
    slow = SLOW / float(model.opt.timestep)
    moving = [magnet for magnet in magnets if 0 < now.get(magnet.body, 0) < slow]
    if len(moving) < len(now) or not moving:
        return
    magnet = max(moving, key=lambda each: now[each.body])
    geoms = model.body_weldid[model.geom_bodyid] == magnet.body
    size = float(model.geom_rbound[geoms].max(initial=0))
    others = np.concatenate([each.positions for each in magnets if each.body != magnet.body])
    nearest = cdist(magnet.positions, others).min()
    polarization = VACUUM_PERMEABILITY * magnet.strengths.sum() / max(4 * size**3, 1e-300)
    if size and (nearest > FAR * size or polarization < FAINT):
        yield Failure(
            label(model, "body", magnet.body),
            "hardly feels the other magnets: in their field, it swings or turns at no more than"
            f" {now[magnet.body]:.2g} rad/s, since the nearest one is {nearest:.3g} m away and it"
            f" has {magnet.strengths.max():.3g} A m^2 and a radius of {size:.3g} m; are all lengths"
            " in meters?",
            len(moving),
        )


def _long_pieces(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield pieces of iron over which an applied field varies too unevenly for one dipole."""
    for geom, bend in bent_fields(model, state):
        if bend == np.inf:
            sentence = "reaches beyond the table of an applied field; enlarge the table"
        else:
            sentence = (
                "feels an applied field at its center only, but that field varies far from linearly"
                " along it, so that the force may be several times too strong or too weak"
            )
            if declared.iron(model)[geom] < WEAK:
                sentence += "; a row of spheres follows the field"
        if bend > BENT:
            yield Failure(label(model, "geom", geom), f"of iron {sentence}")


def _exposure(model: mujoco.MjModel, pair: Meeting) -> Failure:
    why = "a dipole is on or outside the surface of its body's colliding geoms"
    if not len(pair.touching):
        why = "their geoms do not collide"
    if pair.soft_limit >= 0:
        why += f" and the limit of {label(model, 'joint', pair.soft_limit)} is too soft"
    where = "a dipole is in the plane of iron" if _has_plane(pair) else "their dipoles coincide"
    return Failure(
        _names(model, pair),
        f"can come so near that {where}, since {why}; enclose the dipoles in geoms that collide",
        pair.number,
    )


def _coarseness(model: mujoco.MjModel, pair: Meeting, apart: float, within: float) -> Failure:
    partners = "their images" if _has_plane(pair) else "each other"
    return Failure(
        _names(model, pair),
        "attract each other too strongly in poses in which they touch: there, dipoles are"
        f" {apart:.2g} m from {partners}, and each stands for a piece of {within:.2g} m; take a"
        " layout such as mm.magnet's for error=0.5 and a gap of 0.3 times its thickness or, if it"
        " is longer than wide, of 0.4 times its width",
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
        constant = _rounded_down(min(limits))
        long = 0 < contacts[k].solref[0] < shortest
        lengthened = f" (as the timestep of {step:g} s makes it)" if long else ""
        half = _rounded_down(constant / SHORTEST)
        bound = "at most" if pair.exact else "up to about"
        if half < ABSURD * step:
            yield _exposure(model, pair)
            return
        yield Failure(
            _names(model, pair),
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
        shorter = _rounded_down(longest)
        yield Failure(
            _names(model, pair),
            f"meet in a contact that moves within {SHORTEST * longest:.3g} s; take a timestep of at"
            f" most {shorter:g} s, not {step:g} s",
            pair.number,
            shorter,
        )


def _assumed(model: mujoco.MjModel, pair: Meeting) -> str:
    """Say which coils are taken at a drive that nothing bounds, and which limit is too soft."""
    names = {label(model, "actuator", m.unbounded) for m in pair.magnets if m.unbounded >= 0}
    said = f" (at drive 1 of {' and '.join(sorted(names))}, which nothing bounds)" if names else ""
    if pair.soft_limit >= 0:
        said += f" (the limit of {label(model, 'joint', pair.soft_limit)} is too soft to keep them"
        said += " apart)"
    return said


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
    by, unit = ("by", "their radius") if pair.exact else ("by up to", "the depth of a dipole")
    return (
        f"will stick, but penetrate each other {by} {rest * percent:.2g} % of {unit} at rest, and"
        f" by up to {math.ceil(deepest * percent)} % as they meet"
    )


def _fast_magnets(
    model: mujoco.MjModel, now: dict[int, float], state: mujoco.MjData, pairs: list[Meeting]
) -> Iterator[Failure]:
    """Yield a failure of the fastest magnet now, and one of each pair at touch, if too fast."""
    found = [(now[body], label(model, "body", body), 1, "") for body in now]
    found = sorted(found, reverse=True)[:1]
    for pair in pairs:
        for approach, where in (
            (pair.approach, " where they touch"),
            (pair.linked, " where their joints let them come nearest"),
        ):
            if approach:
                frequency = frequency_at_touch(model, state, pair.magnets, approach)
                known = max(now.get(magnet.body, 0) for magnet in pair.magnets)
                if approach is pair.approach or frequency > SLACK * known:
                    found.append((frequency, _names(model, pair), pair.number, where))
    step = float(model.opt.timestep)
    for frequency, name, number, where in found:
        if frequency == math.inf:
            yield Failure(
                name,
                f"would turn or swing{where} so fast that its frequency overflows, since a moment,"
                " a field, a coil or a factor is too large",
                number,
            )
        elif frequency * step > UNSTABLE:
            longest, remedy = _rounded_down(RESOLVED / frequency), "move its dipoles apart"
            if longest < ABSURD * step:
                longest = math.inf
            else:
                remedy = f"take a timestep of at most {longest:g} s"
            yield Failure(
                name,
                f"can swing or turn with omega = {frequency:.3g} rad/s at most{where}, so that"
                f" omega h = {frequency * step:.3g} exceeds 2; {remedy}",
                number,
                longest,
            )


def _unkept_spins(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield at most one failure: a spin that the integrator does not keep."""
    spin = unkept_spin(model, state)
    if not spin:
        return
    step, shorter = float(model.opt.timestep), _rounded_down(spin.timestep)
    least = ABSURD * step
    with_rk4 = step if spin.of_rk4 == step else _rounded_down(spin.of_rk4)
    remedies = [f"a timestep of at most {shorter:g} s"] if shorter > least else []
    if with_rk4 > least and spin.integrator != "RK4":
        also = f" and a timestep of at most {with_rk4:g} s" if with_rk4 < step else ""
        remedies.insert(0, f"the integrator RK4{also}")
    cheaper = spin.integrator != "RK4" and with_rk4 > max(least, STAGES * shorter)
    timestep = with_rk4 if cheaper else shorter
    change, why = "grows", "is explicit in gyroscopic forces"
    if spin.rate < 0:
        change, why = "decays", "damps it, so that a torque can tip the body"
    yield Failure(
        label(model, "body", spin.body),
        f"{spin.verb} with {spin.speed:.3g} rad/s{spin.where}, and its wobble {change} e-fold"
        f" within {1 / abs(spin.rate):.2g} s, since the integrator {spin.integrator} {why}; take"
        f" {' or '.join(remedies) or 'a shorter timestep'}",
        spin.number,
        timestep if timestep > least else math.inf,
        integrator="RK4" if cheaper else "",
    )


def _noise(found: Description) -> Iterator[Failure]:
    kT, mismatch = found.kT, found.mismatch
    if kT is not None and mismatch > MATCH:
        ends = "without bound" if kT[1] == math.inf else f"from {kT[0]:.3g} J to {kT[1]:.3g} J"
        part = "" if mismatch == math.inf else f" by {100 * mismatch:.2g} %"
        yield Failure(
            "noise and damping",
            f"differ{part}, so that the temperatures kT of the motions range {ends}; take the noise"
            " from mm.brownian_rows or mm.JointNoise",
        )


def _has_plane(pair: Meeting) -> bool:
    return pair.magnets[1].images != 0


def _names(model: mujoco.MjModel, pair: Meeting) -> str:
    names = [each.name(model, n) for each, n in zip(pair.magnets, pair.nearest, strict=True)]
    if all(name.startswith("body '") for name in names):
        return f"bodies {names[0][5:]} and {names[1][5:]}"
    return " and ".join(names)


def _rounded_down(value: float) -> float:
    """Return a number with two digits that is not larger."""
    value = max(value, 1e-30)
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.floor(value / digit * SLACK) * digit:.6g}")
