"""Which wrenches that a user has set in `xfrc_applied` the callback overwrites.

In `notes` of mjData, it keeps the time, and for each body a checksum of its wrench: one that has
changed since, and is overwritten, was set by the user. Two sums of them tell states that come back:
of the wrenches as they are left, and as they were when the time was another one.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false

import mujoco

from magmotor.mjcf import layout, memory
from magmotor.mjcf.reports import warn_of_overwritten
from magmotor.numerics.numba_cache import compiled_once
from magmotor.numerics.subroutine import subroutine

TIME, START, BEFORE, NOW, FIRST = 0, 1, 2, 3, 3
"""Numbers of notes: the time, a checksum of the accelerations with which the solver started, two
sums of checksums of wrenches, and the number before that of body 1."""

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
    """Note the checksum of each wrench that differs from what was noted, else 0."""
    notes, wrenches = _notes(m, d, offsets), d[offsets.xfrc_applied // 8]
    total = 0
    for body in range(1, len(notes) - FIRST):
        found = _checksum(wrenches, body)
        total += found
        notes[FIRST + body] = found if found != notes[FIRST + body] else 0
    if total == notes[BEFORE]:  # a state that comes back brings the wrenches that were left in it
        for body in range(1, len(notes) - FIRST):
            notes[FIRST + body] = 0


@subroutine
def note_ours(m, d, offsets, later_stage):
    """Note the checksum of each wrench, and report a body whose noted wrench was overwritten."""
    notes, wrenches = _notes(m, d, offsets), d[offsets.xfrc_applied // 8]
    time = memory.words(d.ctypes.data + offsets.time, 1)[0]
    lost, total = 0, 0
    for body in range(1, len(notes) - FIRST):
        left = _checksum(wrenches, body)
        total += left
        if notes[FIRST + body] != 0 and notes[FIRST + body] != left:
            lost = body
        notes[FIRST + body] = left
    start = _start(m, d, offsets)
    stays = time == notes[TIME] and start == notes[START]  # as after mj_forward
    if lost > 0 and (stays or (time >= notes[TIME] and _continues(m, d, offsets))):
        warn_of_overwritten(lost, m.ctypes.data)
    if time != notes[TIME]:
        notes[BEFORE] = notes[NOW]
    if later_stage:  # the state at the end of the step keeps these wrenches
        notes[BEFORE] = total
    notes[NOW], notes[TIME], notes[START] = total, time, start


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
    return total


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
    nv = m[offsets.nv // 8]
    kept = memory.words(d[offsets.qacc_warmstart // 8], nv)
    found = memory.words(d[offsets.qacc // 8], nv)
    smooth = memory.words(d[offsets.qacc_smooth // 8], nv)
    same = same_smooth = True
    for k in range(nv):
        same = same and kept[k] == found[k]
        same_smooth = same_smooth and kept[k] == smooth[k]
    return same or same_smooth
