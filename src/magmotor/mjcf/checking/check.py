"""`check`: what of a model with magnets will fail, before it runs, and settings that do not."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import reject
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.closest_approach import Meeting, meetings
from magmotor.mjcf.checking.contact_rule import (
    FLIGHT,
    IMPACT,
    SHORTEST,
    SUNK,
    Approach,
    Softness,
    longest_time_constant,
    owners_of,
    rest_and_barrier,
    shortest_kept,
    softness,
)
from magmotor.mjcf.checking.frequencies import frequencies, frequency_at_touch
from magmotor.mjcf.checking.strengths import magnets_of
from magmotor.mjcf.forces.marks import NOISE
from magmotor.mjcf.langevin.temperature import MATCH, joined, temperatures
from magmotor.mjcf.lookup import label

UNSTABLE, RESOLVED = 2.0, 0.5
"""Product of frequency and timestep at which Euler's method fails, and that of a proposed step."""

LISTED = 4
"""Largest number of names that the text lists."""

SLACK = 1 + 1e-6
"""Rounding allowed in comparisons with limits."""


@dataclass(frozen=True)
class Check:
    """What will fail in a model; `print` shows it.

    Attributes
    ----------
    findings : tuple of str
        One sentence for each failure. It names the elements, the numbers, and what to do.
    timestep : float
        The longest timestep in s, up to the model's own, with which the proposed contacts hold and
        all magnets turn and swing stably.
    solref : dict of str to (float, float)
        Proposed time constant in s and damping ratio of the contacts of each geom, contact pair or
        option that holds too weakly.
    settings : tuple of str
        What is proposed or has been set, as text.
    """

    findings: tuple[str, ...]
    timestep: float
    solref: dict[str, tuple[float, float]]
    settings: tuple[str, ...]

    def __str__(self) -> str:
        """Return one line for each finding and each setting."""
        return "\n".join([*self.findings, *self.settings] or ["nothing to fix"])


@checked
def check(model: mujoco.MjModel, data: mujoco.MjData | None = None, *, fix: bool = False) -> Check:
    """Print and return what of a model with magnets will fail, and settings that do not.

    It compares the frequencies of the magnets with the timestep, in the state given and where their
    geoms touch; the contacts with the forces that they must hold; and noise with damping. It finds
    dipoles that can come nearer to each other than their geoms, and magnets that overlap.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData, optional
        The state; default: the initial one.
    fix : bool, default False
        Set the proposed timestep and `solref` in the model.

    Returns
    -------
    Check

    Raises
    ------
    ValueError
        The model's mark, or something that it names, is invalid; or the data belong to another
        model.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> model = mujoco.MjModel.from_xml_string('''
    ... <mujoco>
    ...   <custom><text name="magmotor" data="dipoles"/></custom>
    ...   <worldbody>
    ...     <body name="one"><freejoint/><geom size=".005" density="7500"/><site user="0.5"/></body>
    ...     <body name="other" pos="0 0 0.05">
    ...       <freejoint/><geom size=".005" density="7500"/><site user="0.5"/>
    ...     </body>
    ...   </worldbody>
    ... </mujoco>''')
    >>> found = mm.check(model, fix=True)  # doctest: +ELLIPSIS
    bodies 'one' and 'other' will fly apart once they touch: where they touch, they attract ...
    set: solref="0.00034 1" of geom 0 and geom 1
    set: timestep 0.00017 s
    >>> found = mm.check(model)
    nothing to fix
    """
    with np.errstate(all="ignore"):
        found = [*_failures(model, _state(model, data))]
    numbers = {name: row for failure in found for name, row in failure.owners}
    constants = dict.fromkeys(numbers, math.inf)
    for failure in found:
        for name, _ in failure.owners:
            constants[name] = min(constants[name], failure.constant)
    timestep = min([float(model.opt.timestep), *(failure.timestep for failure in found)])
    done, settings = "set" if fix else "proposed", []
    if constants:
        ends = sorted({min(constants.values()), max(constants.values())})
        shown = " to ".join(f'solref="{constant:g} 1"' for constant in ends)
        settings.append(f"{done}: {shown} of {_listed([*constants])}")
    if timestep < model.opt.timestep:
        settings.append(f"{done}: timestep {timestep:g} s")
    if fix:
        model.opt.timestep = timestep
        for name, row in numbers.items():
            row[:2] = constants[name], 1.0
    result = Check(
        findings=tuple(_merged(found)),
        timestep=timestep,
        solref={name: (constant, 1.0) for name, constant in constants.items()},
        settings=tuple(settings),
    )
    print(result)
    return result


class _Failure(NamedTuple):
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


def _merged(found: list[_Failure]) -> Iterator[str]:
    """Yield one sentence for all failures that differ in their subjects only."""
    for predicate in dict.fromkeys(failure.predicate for failure in found):
        alike = [failure for failure in found if failure.predicate == predicate]
        others = sum(failure.number for failure in alike) - 1
        more = f" (and {others} more like {'them' if ' and ' in alike[0].subject else 'it'})"
        yield f"{alike[0].subject}{more * (others > 0)} {predicate}"


def _listed(names: list[str]) -> str:
    more = [f"{len(names) - LISTED} more"] if len(names) > LISTED else []
    return joined(names[:LISTED] + more)


def _state(model: mujoco.MjModel, data: mujoco.MjData | None) -> mujoco.MjData:
    """Return the state with positions, inertia and contacts computed, in an mjData of its own."""
    state = mujoco.MjData(model)
    if data is not None:
        for name in ("qpos", "mocap_pos", "mocap_quat"):
            there, here = getattr(data, name), getattr(state, name)
            if there.shape != here.shape:
                raise reject(f"shape of data.{name}", there.shape, f"must be {here.shape}")
            here[:] = there
    mujoco.mj_fwdPosition(model, state)
    return state


def _failures(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[_Failure]:
    kinds = acting_forces(model)
    pairs = [*meetings(model, state)]
    yield from _overlaps(model, state)
    for pair in pairs:
        if pair.exposed:
            yield _exposure(model, pair)
        if pair.approach:
            yield from _weak_contacts(model, pair, pair.approach)
    yield from _fast_magnets(model, state, pairs)
    if kinds & NOISE and model.nuser_body:
        yield from _noise(model)


def _overlaps(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[_Failure]:
    """Yield geoms of magnets that overlap by more than contacts should allow."""
    magnetic = {magnet.body for magnet in magnets_of(model, state)}
    for contact in state.contact:
        geoms = contact.geom
        if (geoms < 0).any():
            continue
        radii = model.geom_rbound[geoms]
        welds = model.body_weldid[model.geom_bodyid[geoms]]
        if {*welds.tolist()} <= magnetic and -contact.dist > SUNK * radii[radii > 0].min():
            names = " and ".join(label(model, "geom", geom) for geom in geoms)
            yield _Failure(
                names, f"of magnets overlap by {-contact.dist:.2g} m at the start; move them apart"
            )


def _exposure(model: mujoco.MjModel, pair: Meeting) -> _Failure:
    why = "a dipole is on or outside the surface of its body's colliding geoms"
    if not len(pair.touching):
        why = "their geoms do not collide"
    return _Failure(
        _names(model, pair),
        f"can come so near that their dipoles coincide, since {why}; enclose the dipoles in geoms"
        " that collide",
        pair.number,
    )


def _weak_contacts(model: mujoco.MjModel, pair: Meeting, approach: Approach) -> Iterator[_Failure]:
    """Yield at most one failure: that of the weakest contact of two magnets."""
    step = float(model.opt.timestep)
    shortest = shortest_kept(model, step)
    contacts = [softness(model, *row) for row in pair.touching.tolist()]
    limits = [longest_time_constant(approach, contact) for contact in contacts]
    given = [contact.stiffness_time(shortest) for contact in contacts]
    k = int(np.divide(given, limits).argmax())
    longest = min(contact.resolved_time(shortest) for contact in contacts) / SHORTEST
    if given[k] > SLACK * limits[k]:
        constant = _rounded_down(min(limits))
        long = 0 < contacts[k].solref[0] < shortest
        lengthened = f" (as the timestep of {step:g} s makes it)" if long else ""
        half = _rounded_down(constant / SHORTEST)
        yield _Failure(
            _names(model, pair),
            f"{_outcome(approach, contacts[k], given[k], step)}: where they touch, they attract"
            f" each other with up to {approach.force:.3g} N; the time constant of their"
            f" contact must be at most {constant:g} s, not {given[k]:.3g} s{lengthened}"
            + (f", and the timestep at most {half:g} s" if step > half else ""),
            pair.number,
            half,
            constant,
            owners_of(model, pair.like),
        )
    elif step > SLACK * longest:
        shorter = _rounded_down(longest)
        yield _Failure(
            _names(model, pair),
            f"meet in a contact that moves within {SHORTEST * longest:.3g} s; take a timestep of at"
            f" most {shorter:g} s, not {step:g} s",
            pair.number,
            shorter,
        )


def _outcome(approach: Approach, contact: Softness, constant: float, step: float) -> str:
    """Say what will happen where a contact is too soft."""
    rest, barrier = rest_and_barrier(approach, contact, constant)
    if rest == math.inf:
        return "will fly apart once they touch"
    flight, impact = FLIGHT * step / approach.time, IMPACT * constant / approach.time
    if flight + impact > barrier:
        return "may fly apart if they meet at speed"
    radii = 100 * approach.distance / approach.depth
    return (
        f"will stick, but penetrate each other by {rest * radii:.2g} % of their radius at rest, and"
        f" by up to {max(flight, impact) * radii:.2g} % as they meet"
    )


def _fast_magnets(
    model: mujoco.MjModel, state: mujoco.MjData, pairs: list[Meeting]
) -> Iterator[_Failure]:
    """Yield a failure of the fastest magnet now, and one of each pair at touch, if too fast."""
    now = frequencies(model, state)
    found = [(now[body], label(model, "body", body), 1, "") for body in now]
    found = sorted(found, reverse=True)[:1]
    for pair in pairs:
        if pair.approach:
            frequency = frequency_at_touch(model, state, pair.magnets, pair.approach)
            found.append((frequency, _names(model, pair), pair.number, " where they touch"))
    step = float(model.opt.timestep)
    for frequency, name, number, where in found:
        if frequency * step > UNSTABLE:
            longest = _rounded_down(RESOLVED / frequency)
            yield _Failure(
                name,
                f"can swing or turn with omega = {frequency:.3g} rad/s{where}, so that omega h ="
                f" {frequency * step:.3g} exceeds 2; take a timestep of at most {longest:g} s",
                number,
                longest,
            )


def _noise(model: mujoco.MjModel) -> Iterator[_Failure]:
    kT, mismatch, _ = temperatures(model)
    if kT is not None and mismatch > MATCH:
        ends = "without bound" if kT[1] == math.inf else f"from {kT[0]:.3g} J to {kT[1]:.3g} J"
        part = "" if mismatch == math.inf else f" by {100 * mismatch:.2g} %"
        yield _Failure(
            "noise and damping",
            f"differ{part}, so that the temperatures kT of the motions range {ends}; take the noise"
            " from mm.brownian_rows or mm.JointNoise",
        )


def _names(model: mujoco.MjModel, pair: Meeting) -> str:
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, each.body) for each in pair.magnets]
    if all(names):
        return f"bodies {names[0]!r} and {names[1]!r}"
    return " and ".join(label(model, "body", each.body) for each in pair.magnets)


def _rounded_down(value: float) -> float:
    """Return a number with two digits that is not larger."""
    value = max(value, 1e-30)
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.floor(value / digit * SLACK) * digit:.6g}")
