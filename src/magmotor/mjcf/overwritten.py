"""Which wrenches that a user has set in `xfrc_applied` the callback overwrites.

In `notes` of mjData, it keeps the time, and for each body a checksum of its wrench: one that has
changed since, and is overwritten, was set by the user.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false

import mujoco

from magmotor.mjcf import layout, memory
from magmotor.mjcf.reports import warn_of_overwritten
from magmotor.numerics.numba_cache import compiled_once
from magmotor.numerics.subroutine import subroutine

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
        for body in range(1, len(notes)):
            notes[body] = _checksum(d[offsets.xfrc_applied // 8], body)

    return note


@subroutine
def note_others(m, d, offsets):
    """Note the checksum of each wrench that differs from what was noted, else 0."""
    notes, wrenches = _notes(m, d, offsets), d[offsets.xfrc_applied // 8]
    for body in range(1, len(notes)):
        found = _checksum(wrenches, body)
        notes[body] = found if found != notes[body] else 0


@subroutine
def note_ours(m, d, offsets):
    """Note the checksum of each wrench, and report a body whose noted wrench was overwritten."""
    notes, wrenches = _notes(m, d, offsets), d[offsets.xfrc_applied // 8]
    time = memory.words(d.ctypes.data + offsets.time, 1)[0]
    lost = 0
    for body in range(1, len(notes)):
        left = _checksum(wrenches, body)
        if notes[body] != 0 and notes[body] != left:
            lost = body
        notes[body] = left
    if lost > 0 and time >= notes[0] and _continues(m, d, offsets):
        warn_of_overwritten(lost, m.ctypes.data)
    notes[0] = time


@subroutine
def _notes(m, d, offsets):
    """Return the words of mjData for notes: the time, and a checksum for each body from 1 on."""
    return memory.words(d.ctypes.data + offsets.notes, min(m[offsets.nbody // 8], layout.NOTES))


@subroutine(forceinline=True)
def _checksum(wrenches, body):
    """Return a number that tells the wrench of a body from others; 0 without a wrench."""
    words = memory.words(wrenches + 48 * body, 6)
    total = 0
    for k in range(6):
        total += words[k] * WEIGHTS[k]
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
