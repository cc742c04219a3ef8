"""The compiled callback compared with the same wrench in NumPy and from magpylib."""

import ctypes
from functools import partial

import mujoco
from numba import njit

import magmotor as mm
from benchmarks.harness.stepping import Stepper
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of
from benchmarks.peers import wrench
from trials.numpy_twin import apply_magnetism

PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64)
CALLS = 10_000
NOTE = """\
The wrench on the planar top's ball from 20 dipoles, written to xfrc_applied; magpylib's getFT
  computes it from a collection. The callback is called through its C pointer in a compiled loop."""


def main() -> None:
    scene = mm.Top()
    stepper = Stepper(mm.build(scene))
    model, data = stepper.model, stepper.data
    with mm.magnetism():
        call = ctypes.cast(mujoco.get_mjcb_control(), PROTOTYPE)
    calls = partial(_call_often, call, model._address, data._address, CALLS)
    twin, magpylib = (
        partial(apply, model, data) for apply in (apply_magnetism, wrench.by_magpylib(scene))
    )
    cases = {
        "callback": lambda: seconds_of(calls) / CALLS,
        "twin": partial(seconds_of, twin, 20),
        "magpylib": partial(seconds_of, magpylib, 5),
    }
    times = in_turns(cases, turns=60)
    rows = [
        Row("NumPy twin", times["twin"], times["callback"], at_least=100),
        Row("magpylib.getFT", times["magpylib"], times["callback"], at_least=1000),
    ]
    show("Compiled callback", NOTE, ("time", "callback", "ratio"), rows)


@njit
def _call_often(call, model, data, count):
    for _ in range(count):
        call(model, data)
