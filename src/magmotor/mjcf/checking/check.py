"""`check`: which parts of a model with magnets will fail, and settings that prevent it."""

import copy
import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.all_findings import Failure, failures
from magmotor.mjcf.checking.closest_approach import Known
from magmotor.mjcf.checking.element_order import require_order
from magmotor.mjcf.describe import Description, describe, elsewhere
from magmotor.mjcf.langevin.temperature import joined
from magmotor.mjcf.lookup import INTEGRATORS
from magmotor.mjcf.model_parts import compiled
from magmotor.mjcf.not_acting import renamed
from magmotor.mjcf.unit_system import own_units

SOUND = "nothing to fix"
EMPTY = "nothing acts on this model: it has no dipoles, fields, coils or iron"
"""What the text says without findings."""

NOTE = "note: {}"
"""The line of a note."""

ROUNDS = 8
"""Most settings that are tried in turn until no failure proposes another."""

FULL = 20
"""Largest number of findings in the text; `findings` has all."""

LISTED = 4
"""Largest number of names that the text lists."""


@dataclass(frozen=True)
class Check:
    """What will fail in a model, as text for `print`.

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
    integrator : str
        "RK4" if it is proposed, for a body that spins; "" if the model's own stays.
    settings : tuple of str
        What is proposed or has been set, as text.
    acting : bool
        Whether anything of magmotor acts on the model.
    units : tuple of str
        What the units in these sentences stand for, if the model's are not those of SI.
    notes : tuple of str
        Where the forces do not act, which is no failure inside `magnetism()`; how magnets and iron
        by their geom are described; and doubts, such as distances that are probably in other units,
        and what is not judged, such as spins that the model does not tell.
    """

    findings: tuple[str, ...]
    timestep: float
    solref: dict[str, tuple[float, float]]
    integrator: str
    settings: tuple[str, ...]
    acting: bool
    units: tuple[str, ...]
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        """Return one line for each finding, up to 20, each setting and each note."""
        more = len(self.findings) - FULL
        counted = [f"and {more} more findings"] * (more > 1)
        found = [*self.findings[: FULL + (more == 1)], *counted, *self.settings]
        lines = [*found, *self.units] if found else [SOUND if self.acting else EMPTY]
        return "\n".join([*lines, *map(NOTE.format, self.notes)])


@checked
def check(
    model: mujoco.MjSpec | mujoco.MjModel,
    data: mujoco.MjData | None = None,
    *,
    fix: bool = False,
) -> Check:
    """Return which parts of a model with magnets will fail, and settings that prevent it.

    It compares the frequencies of the magnets with the timestep, in the state given and where their
    geoms touch; the contacts, and limits of slides, with the forces that they must hold, also on a
    plane of iron; spins, in the state given and in keyframes, with what the integrator keeps (see
    the page "Bodies that spin"); and noise with damping. It finds dipoles that can come nearer to
    each other than their geoms or than others of their layout, dipoles where no force is defined,
    magnets and iron that overlap, and iron that nodes do not resolve. Notes say how magnets and
    iron by their geom are described, how right that is, and what it costs.

    Parameters
    ----------
    model : mujoco.MjModel or mujoco.MjSpec
        A spec is compiled, which numbers its elements.
    data : mujoco.MjData, optional
        The state; default: the initial one.
    fix : bool, default False
        Set the proposed timestep, `solref` and integrator in the model or the spec; then
        `spec.to_xml()` contains them, too.

    Returns
    -------
    Check

    Raises
    ------
    ValueError
        The spec does not compile; the model's timestep or mark, or something that the mark names,
        is invalid; or the data are not finite or belong to another model.

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
    >>> print(mm.check(model, fix=True))  # doctest: +ELLIPSIS
    bodies 'one' and 'other' will fly apart once they touch: where they touch, they attract ...
    set: solref="0.00034 1" of geom 0 of body 'one' and geom 1 of body 'other'
    set: timestep 0.00017 s
    note: not acting: dipoles outside of magmotor.magnetism(), since the model has no plugin ...
    >>> print(mm.check(model))  # doctest: +ELLIPSIS
    nothing to fix
    note: not acting: dipoles outside of magmotor.magnetism(), since the model has no plugin ...
    """
    if isinstance(model, mujoco.MjSpec):
        own = compiled(model)
        result = check(own, data, fix=fix)
        if fix:
            _copy_settings(own, model)
        return result
    check_number("timestep of the model", model.opt.timestep, above=0)
    acting_forces(model)  # an invalid model would crash MuJoCo's functions
    require_order(model)
    tried, solref, integrator = copy.copy(model), {}, ""
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the plugin, since the findings say the same
        state, description = _state(model, data), describe(model)
        known = Known()
        found = [*failures(tried, state, description, known)]
        first, doubts = ([each for each in found if each.note is kind] for kind in (False, True))
        for _ in range(ROUNDS):  # since one proposal may need another
            step, constants = tried.opt.timestep, _proposed(found)
            tried.opt.timestep = min([step, *(failure.timestep for failure in found)])
            chosen = next((failure.integrator for failure in found if failure.integrator), "")
            tried.opt.integrator = INTEGRATORS[chosen] if chosen else tried.opt.integrator
            for name, (constant, row) in constants.items():
                row[:2] = solref[name] = constant, 1.0
            integrator = chosen or integrator
            if not (constants or chosen or tried.opt.timestep < step):
                break
            found = [*failures(tried, _state(tried, data), description, known)]
    timestep = float(tried.opt.timestep)
    done, settings = "set" if fix else "proposed", []
    if solref:
        ends = sorted({min(solref.values())[0], max(solref.values())[0]})
        shown = " up to ".join(f'"{constant:g} 1"' for constant in ends)
        settings.append(f"{done}: solref={shown} of {_listed([*solref])}")
    if timestep < model.opt.timestep:
        settings.append(f"{done}: timestep {timestep:g} s")
    if integrator:
        settings.append(f"{done}: integrator {integrator}")
    if fix:
        model.opt.timestep, model.opt.integrator = timestep, tried.opt.integrator
        model.opt.o_solref[:] = tried.opt.o_solref
        model.geom_solref[:], model.pair_solref[:] = tried.geom_solref, tried.pair_solref
    return Check(
        findings=tuple(_merged(first)),
        timestep=timestep,
        solref=solref,
        integrator=integrator,
        settings=tuple(settings),
        acting=bool(description.acting),
        units=own_units(model),
        notes=(
            *(f"not acting: {each}" for each in _idle(model, description)),
            *_merged(doubts),
        ),
    )


def _proposed(found: list[Failure]) -> dict[str, tuple[float, Array]]:
    """Return the time constants of contacts that are too long, and the numbers that hold them."""
    constants = {}
    for failure in found:
        for name, row in failure.owners:
            constant, _ = constants.get(name, (math.inf, row))
            constants[name] = min(constant, failure.constant), row
    for name, (constant, row) in [*constants.items()]:
        if 0 < row[0] <= constant:  # one may be stiff enough, and the other one to blame
            constants[name] = float(row[0]), row
            if row[1] == 1.0:
                del constants[name]
    return constants


def _idle(model: mujoco.MjModel, found: Description) -> Iterator[str]:
    """Yield what does not act, and where, unless a finding says so."""
    yield from elsewhere(found, briefly=found.marked)
    yield from renamed(model) if found.acting else ()


def _copy_settings(model: mujoco.MjModel, spec: mujoco.MjSpec) -> None:
    """Set in a spec what `fix` sets in the model compiled from it."""
    spec.option.timestep, spec.option.integrator = model.opt.timestep, model.opt.integrator
    spec.option.o_solref = model.opt.o_solref
    for elements, solref in ((spec.geoms, model.geom_solref), (spec.pairs, model.pair_solref)):
        for element in elements:
            if (element.solref != solref[element.id]).any():
                element.solref = solref[element.id]


def _merged(found: list[Failure]) -> Iterator[str]:
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
        for name in ("qpos", "qvel", "mocap_pos", "mocap_quat", "ctrl", "act"):
            there, here = getattr(data, name), getattr(state, name)
            if there.shape != here.shape:
                raise ArgumentError(f"shape of data.{name}", there.shape, f"must be {here.shape}")
            if not np.isfinite(there).all():
                raise ArgumentError(f"data.{name}", there, "must be finite")
            here[:] = there
    mujoco.mj_fwdPosition(model, state)
    return state
