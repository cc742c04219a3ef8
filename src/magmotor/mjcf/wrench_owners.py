"""Whose the wrenches in `xfrc_applied` are: the user's, or the callback's.

In `notes` of mjData, the callback keeps the time, and for each body a checksum of its wrench and
whether it is the callback's own. Its own wrenches are set to zero before the next ones are
computed, so that what acts no longer, as a magnet that is switched off, leaves none. A wrench that
has changed since, and is overwritten, was set by the user. A sum of the checksums tells a state
that comes back with the wrenches that were in it. A wrench that is set after `mj_step1` may act in
`mj_step2`, and is not reported.
"""

import mujoco
import numpy as np

from magmotor.mjcf import layout, memory
from magmotor.mjcf.error_reports import warn_of_overwritten
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine

TIME, START, FOUND, FORWARDS, FIRST = 0, 1, 2, 3, 3
"""Numbers of notes: the time, a checksum of the accelerations with which the solver started, the
sum of the checksums of the wrenches that came with this state, how often `mj_forward` had begun, or
0 before the first time, and the number before body 1's."""

OURS, CHANGED, FLAGS = 1, 2, 3
"""Bits of a body's note beside its checksum, whose last two bits are 0: whether the wrench is the
callback's own, and whether it has changed since it was noted."""

CLOSE = 1.5
"""Time from one evaluation to the next, in timesteps, above which a state was loaded between."""

WEIGHTS = tuple(int(memory.MULTIPLIER) * k % 2**62 | 1 for k in range(1, 7))
"""Odd numbers by which the words of a wrench enter its checksum."""


def note_wrenches(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Note what a thermostat left in `xfrc_applied`, which a block must not take for others'."""
    _note(layout.current())(model._address, data._address)


@compiled_once(error_model="numpy")
def _note(checksum: int, offsets: layout.Layout):
    """Define `note_wrenches` for one layout of the structs."""

    def note(model, data):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        notes = _notes(m, d, offsets)
        for body in range(1, len(notes) - FIRST):
            notes[FIRST + body] = _checksum(d[offsets.xfrc_applied // 8], body)

    return note


@subroutine
def note_others(m, d, offsets):
    """Set our own wrenches to zero, and note the others and whether they have changed."""
    notes, wrenches = _notes(m, d, offsets), d[offsets.xfrc_applied // 8]
    applied = memory.numbers(wrenches, memory.UNBOUNDED, 6)
    total = 0
    for body in range(1, len(notes) - FIRST):
        found, noted = _checksum(wrenches, body), notes[FIRST + body]
        total += found
        if found != noted & ~FLAGS:
            notes[FIRST + body] = found | CHANGED
        elif noted & OURS:
            applied[body] = 0.0
            notes[FIRST + body] = 0
        else:
            notes[FIRST + body] = found
    if not _stays(m, d, offsets):
        notes[FOUND] = total
    elif total == notes[FOUND]:  # a state that comes back brings the wrenches that were in it
        for body in range(1, len(notes) - FIRST):
            notes[FIRST + body] &= ~CHANGED


@subroutine
def note_ours(m, d, offsets):
    """Note the wrenches and which are ours, and report a body whose changed one is lost."""
    notes, wrenches = _notes(m, d, offsets), d[offsets.xfrc_applied // 8]
    lost = 0
    for body in range(1, len(notes) - FIRST):
        left, noted = _checksum(wrenches, body), notes[FIRST + body]
        ours = left != noted & ~FLAGS
        if ours and noted & CHANGED and noted & ~FLAGS != 0:
            lost = body
        notes[FIRST + body] = left | OURS if ours else left
    forwards = 1 + np.int64(memory.integers(d.ctypes.data + offsets.forwards, 1)[0])
    at_once = forwards != notes[FORWARDS]
    if lost > 0 and at_once and (_stays(m, d, offsets) or _continues(m, d, offsets)):
        warn_of_overwritten(lost, m.ctypes.data)
    notes[FORWARDS] = forwards
    notes[TIME] = memory.words(d.ctypes.data + offsets.time, 1)[0]
    notes[START] = _start(m, d, offsets)


@subroutine
def _notes(m, d, offsets):
    """Return the words of mjData for notes; those of bodies follow the four of all."""
    count = min(FIRST + m[offsets.nbody // 8], layout.NOTES)
    return memory.words(d.ctypes.data + offsets.notes, count)


@subroutine(forceinline=True)
def _checksum(wrenches, body):
    """Return a number that tells the wrench of a body from others; 0 without a wrench."""
    words = memory.words(wrenches + 48 * body, 6)
    total = 0
    for k in range(6):
        total += words[k] * WEIGHTS[k]
    return (total ^ total >> 32) & ~FLAGS


@subroutine
def _stays(m, d, offsets):
    """Whether the state is the one noted, as after `mj_forward`."""
    notes, time = _notes(m, d, offsets), memory.words(d.ctypes.data + offsets.time, 1)[0]
    return time == notes[TIME] and _start(m, d, offsets) == notes[START]


@subroutine
def _start(m, d, offsets):
    """Return a checksum of the accelerations from which MuJoCo's solver starts; 0 if all are 0."""
    kept = memory.words(d[offsets.qacc_warmstart // 8], m[offsets.nv // 8])
    total = 0
    for k in range(len(kept)):
        total += kept[k] * (2 * k + 1)
    return total


@subroutine
def _continues(m, d, offsets):
    """Whether the state of `mjData` follows from its last step; else wrenches came with it.

    MuJoCo keeps the accelerations of that step: RK4 those of the last stage, before contacts.
    """
    notes = _notes(m, d, offsets)
    before = memory.numbers(notes.ctypes.data, 1, 1)[0, 0]
    elapsed = memory.numbers(d.ctypes.data + offsets.time, 1, 1)[0, 0] - before
    timestep = memory.numbers(m.ctypes.data + offsets.timestep, 1, 1)[0, 0]
    if elapsed < 0.0 or elapsed > CLOSE * timestep:
        return False
    nv = m[offsets.nv // 8]
    kept = memory.words(d[offsets.qacc_warmstart // 8], nv)
    found = memory.words(d[offsets.qacc // 8], nv)
    smooth = memory.words(d[offsets.qacc_smooth // 8], nv)
    same = same_smooth = True
    for k in range(nv):
        same = same and kept[k] == found[k]
        same_smooth = same_smooth and kept[k] == smooth[k]
    return same or same_smooth
