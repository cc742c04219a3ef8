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
from magmotor.mjcf.closest_approach import Meeting, meetings
from magmotor.mjcf.contact_rule import (
    FLIGHT,
    IMPACT,
    SUNK,
    Approach,
    Softness,
    longest_time_constant,
    owners_of,
    rest_and_barrier,
    shortest_kept,
    softness,
)
from magmotor.mjcf.field_and_energy import dipole_sites
from magmotor.mjcf.forces.marks import NOISE
from magmotor.mjcf.frequencies import frequencies, frequency_at_touch
from magmotor.mjcf.langevin.temperature import MATCH, joined, temperatures
from magmotor.mjcf.lookup import label

UNSTABLE, RESOLVED = 2.0, 0.5
"""Product of frequency and timestep at which Euler's method fails, and that of a proposed step."""

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
    fixed : bool
        Whether the proposals have been set in the model.
    """

    findings: tuple[str, ...]
    timestep: float
    solref: dict[str, tuple[float, float]]
    fixed: bool

    def __str__(self) -> str:
        """Return one line for each finding, and one for what is proposed or was set."""
        return "\n".join([*self.findings, *self._settings()] or ["nothing to fix"])

    def _settings(self) -> Iterator[str]:
        constants = [values[0] for values in self.solref.values()]
        if constants:
            ends = [f'solref="{value:g} 1"' for value in sorted({min(constants), max(constants)})]
            names = [*self.solref][:4]
            others = len(constants) - len(names)
            names += [f"{others} more"] if others else []
            yield f"{self._verb()}: {' to '.join(ends)} of {joined(names)}"
        if any("timestep" in finding for finding in self.findings):
            yield f"{self._verb()}: timestep {self.timestep:g} s"

    def _verb(self) -> str:
        return "set" if self.fixed else "proposed"


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
    >>> found = mm.check(model, fix=True)
    >>> found = mm.check(model)
    nothing to fix
    """
    if data is not None and len(data.site_xpos) != model.nsite:
        raise reject("number of sites of data", len(data.site_xpos), f"must be {model.nsite}")
    found = [*_failures(model, _state(model, data))]
    owners: dict[str, Array] = {}
    constants: dict[str, float] = {}
    for failure in found:
        for name, numbers in failure.owners:
            owners[name] = numbers
            constants[name] = min(failure.constant, constants.get(name, math.inf))
    result = Check(
        findings=tuple(failure.sentence for failure in found),
        timestep=min([model.opt.timestep, *(failure.timestep for failure in found)]),
        solref={name: (constant, 1.0) for name, constant in constants.items()},
        fixed=fix,
    )
    if fix:
        model.opt.timestep = result.timestep
        for name, numbers in owners.items():
            numbers[:2] = result.solref[name]
    print(result)
    return result


class _Failure(NamedTuple):
    """One finding, and the settings without it."""

    sentence: str
    timestep: float = math.inf
    constant: float = math.inf
    """Time constant of contacts."""
    owners: tuple[tuple[str, Array], ...] = ()
    """What has the parameters of these contacts: name and numbers."""


def _state(model: mujoco.MjModel, data: mujoco.MjData | None) -> mujoco.MjData:
    """Return a copy of the state with positions, inertia and contacts computed."""
    state = mujoco.MjData(model)
    if data is not None:
        mujoco.mj_copyState(model, data, state, int(mujoco.mjtState.mjSTATE_INTEGRATION))
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
    _, _, bodies = dipole_sites(model, state)
    magnetic = {*model.body_weldid[bodies].tolist()}
    for contact in state.contact:
        geoms = contact.geom
        if (geoms < 0).any():
            continue
        radii = model.geom_rbound[geoms]
        welds = model.body_weldid[model.geom_bodyid[geoms]]
        if {*welds.tolist()} <= magnetic and -contact.dist > SUNK * radii[radii > 0].min():
            names = " and ".join(label(model, "geom", geom) for geom in geoms)
            yield _Failure(
                f"{names} of magnets overlap by {-contact.dist:.2g} m at the start; move them apart"
            )


def _exposure(model: mujoco.MjModel, pair: Meeting) -> _Failure:
    why = "a dipole is on or outside the surface of its body's colliding geoms"
    if not len(pair.touching):
        why = "their geoms do not collide"
    return _Failure(
        f"{_names(model, pair)} can come so near that their dipoles coincide, since {why}; enclose"
        " the dipoles in geoms that collide"
    )


def _weak_contacts(model: mujoco.MjModel, pair: Meeting, approach: Approach) -> Iterator[_Failure]:
    """Yield at most one failure: that of the weakest contact of two magnets."""
    step = float(model.opt.timestep)
    shortest = shortest_kept(model, step)
    contacts = [softness(model, *row) for row in pair.touching.tolist()]
    limits = [longest_time_constant(approach, contact) for contact in contacts]
    given = [contact.stiffness_time(shortest) for contact in contacts]
    k = int(np.divide(given, limits).argmax())
    at_touch = (
        f"at a distance of {approach.distance:.3g} m, their dipoles attract each other with up to"
        f" {approach.force:.3g} N"
    )
    names, constant = _names(model, pair), _rounded_down(min(limits))
    longest = min(contact.resolved_time(shortest) for contact in contacts) / 2
    if given[k] > SLACK * min(limits):
        long = 0 < contacts[k].solref[0] < shortest
        lengthened = f" (as the timestep of {step:g} s makes it)" if long else ""
        yield _Failure(
            f"{names} {_outcome(approach, contacts[k], given[k], step)}: {at_touch}; the time"
            f" constant of their contact must be at most {constant:g} s, not {given[k]:.3g} s"
            f"{lengthened}, and the timestep at most {_rounded_down(constant / 2):g} s",
            _rounded_down(constant / 2),
            constant,
            owners_of(model, pair.like),
        )
    elif step > SLACK * longest:
        yield _Failure(
            f"{names} meet in a contact that moves within {2 * longest:.3g} s, which takes a"
            f" timestep of at most {_rounded_down(longest):g} s, not {step:g} s",
            _rounded_down(longest),
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
    found = [(frequency, label(model, "body", body), "") for body, frequency in
             sorted(frequencies(model, state).items(), key=lambda item: -item[1])[:1]]  # fmt: skip
    for pair in pairs:
        if pair.approach:
            frequency = frequency_at_touch(model, state, pair.magnets, pair.approach)
            found.append((frequency, _names(model, pair), " where they touch"))
    step = float(model.opt.timestep)
    for frequency, name, where in found:
        if frequency * step > UNSTABLE:
            longest = _rounded_down(RESOLVED / frequency)
            yield _Failure(
                f"{name} can swing or turn with omega = {frequency:.3g} rad/s{where}, so that omega"
                f" h = {frequency * step:.3g} exceeds 2; take a timestep of at most {longest:g} s",
                longest,
            )


def _noise(model: mujoco.MjModel) -> Iterator[_Failure]:
    kT, mismatch, _ = temperatures(model)
    if kT is not None and mismatch > MATCH:
        ends = "without bound" if kT[1] == math.inf else f"from {kT[0]:.3g} J to {kT[1]:.3g} J"
        part = "" if mismatch == math.inf else f" by {100 * mismatch:.2g} %"
        yield _Failure(
            f"noise and damping differ{part}, so that the temperatures kT of the motions range"
            f" {ends}; take the noise from mm.brownian_rows or mm.JointNoise"
        )


def _names(model: mujoco.MjModel, pair: Meeting) -> str:
    both = " and ".join(label(model, "body", magnet.body) for magnet in pair.magnets)
    return both + f" (and {pair.number - 1} pairs like them)" * (pair.number > 1)


def _rounded_down(value: float) -> float:
    """Return a number with two digits that is not larger."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.floor(value / digit * SLACK) * digit:.6g}")
