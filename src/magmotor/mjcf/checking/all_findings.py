"""What will fail in a model with magnets, one sentence each, and the settings without it."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np

from magmotor.mjcf.checking.closest_approach import Known, meetings
from magmotor.mjcf.checking.driven_spins import unknown_spins
from magmotor.mjcf.checking.eddy_brakes import speed_notes, strong_brakes
from magmotor.mjcf.checking.failure import Failure
from magmotor.mjcf.checking.field_strengths import unbounded_drives
from magmotor.mjcf.checking.frequencies import frequencies
from magmotor.mjcf.checking.motion_findings import (
    far_magnets,
    fast_joints,
    fast_magnets,
    scattered,
    unkept_spins,
    wide_swings,
)
from magmotor.mjcf.checking.overlaps import overlaps
from magmotor.mjcf.checking.pair_findings import failures_of_pair
from magmotor.mjcf.checking.shape_notes import shape_notes
from magmotor.mjcf.checking.strengths import magnets_of
from magmotor.mjcf.checking.touching_iron import touching_pieces
from magmotor.mjcf.declared import with_kind
from magmotor.mjcf.describe import Description, weighed
from magmotor.mjcf.field_and_energy import magnetic_energy
from magmotor.mjcf.langevin.temperature import MATCH
from magmotor.mjcf.lookup import disabled, given_name, label
from magmotor.mjcf.not_acting import SKIPPED


def failures(
    model: mujoco.MjModel, state: mujoco.MjData, description: Description, known: Known
) -> Iterator[Failure]:
    """Yield what will fail in a state, whose positions and contacts are up to date."""
    pairs, misplaced = [*meetings(model, state, known)], [*_misplaced(model, state)]
    yield from _idleness(model, description)
    yield from _skipped(model, description)
    yield from _huge(description)
    yield from misplaced
    for where, each in _states(model, state):
        yield from overlaps(model, each, where)
    yield from touching_pieces(model, state)
    for pair in pairs:
        yield from failures_of_pair(model, pair)
    now = {} if misplaced else frequencies(model, state)
    yield from far_magnets(model, now, state, description)
    yield from fast_magnets(model, now, state, pairs)
    yield from fast_joints(model, state)
    yield from unkept_spins(model, state)
    yield from () if misplaced else strong_brakes(model, state)
    yield from _noise(description)
    if description.acting:
        yield from shape_notes(model, state, pairs)
        yield from speed_notes(model)
        yield from _doubts(model, state, description, now)


def _doubts(
    model: mujoco.MjModel, state: mujoco.MjData, found: Description, now: dict[int, float]
) -> Iterator[Failure]:
    """Yield notes of what may be wrong, and of what the model does not tell."""
    yield from wide_swings(model, now)
    if {*found.acting} - {"dipoles"}:
        yield from scattered(model, state)
    for spin in unknown_spins(model, state):
        yield Failure("spins", f"{spin} are not judged: give a keyframe with the spin", note=True)
    drives = set()
    for magnet in magnets_of(model, state):
        drives |= {magnet.unbounded} | unbounded_drives(model, state, magnet.body)
    for actuator in sorted(drives - {-1}):
        yield Failure(
            label(model, "actuator", actuator),
            "has no limits, so that all of this is for drives up to 1; a ctrlrange says more",
            note=True,
        )


def _states(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[tuple[str, mujoco.MjData]]:
    """Yield the state, and those of keyframes elsewhere, and how a sentence names them."""
    yield "at the start", state
    for k in range(model.nkey):
        if (model.key_qpos[k] != state.qpos).any() and np.isfinite(model.key_qpos[k]).all():
            data = mujoco.MjData(model)
            mujoco.mj_resetDataKeyframe(model, data, k)
            mujoco.mj_fwdPosition(model, data)
            yield f"in keyframe {given_name(model, 'key', k) or k!r}", data


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
        sentence = str(error).removesuffix("; mm.check(model) says what keeps it above")
        yield Failure(sentence, "(in the state given)")


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
