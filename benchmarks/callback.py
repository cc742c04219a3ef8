"""The compiled callback against the same wrench in NumPy and from magpylib."""

import ctypes
import runpy
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import magpylib
import mujoco
from numba import njit
from stepping import Stepper
from table import Row, in_turns, show

import magmotor as mm

PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64)
TWIN = Path(__file__).parents[1] / "tests" / "numpy_twin.py"
NOTE = """\
The wrench on the planar top's ball from 20 dipoles, written to xfrc_applied; magpylib's getFT
  computes it from a collection. The callback is called through its C pointer in a compiled loop."""


def main() -> None:
    scene = mm.Top()
    apply_magnetism = runpy.run_path(str(TWIN))["apply_magnetism"]
    stepper = Stepper(mm.build(scene))
    model, data = stepper.model, stepper.data
    with mm.magnetism():
        call = ctypes.cast(mujoco.get_mjcb_control(), PROTOTYPE)
    calls = partial(_call_often, call, model._address, data._address)
    calls(1)
    cases = {
        "callback": partial(_seconds, calls, 10_000),
        "twin": partial(_seconds, partial(_repeat, partial(apply_magnetism, model, data)), 20),
        "magpylib": partial(_seconds, partial(_repeat, _magpylib_wrench(scene)), 5),
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


def _repeat(function: Callable[[], object], count: int) -> None:
    for _ in range(count):
        function()


def _seconds(repeat: Callable[[int], object], count: int) -> float:
    begin = time.perf_counter()
    repeat(count)
    return (time.perf_counter() - begin) / count


def _magpylib_wrench(scene: mm.Top) -> Callable[[], object]:
    ring = magpylib.Collection(
        *(
            magpylib.misc.Dipole(position=position, moment=moment)
            for position, moment in zip(*scene.ring_sources(), strict=True)
        )
    )
    place = (*scene.position, scene.ball_radius)
    ball = magpylib.misc.Dipole(position=place, moment=(0, 0, scene.moment))
    return partial(magpylib.getFT, ring, ball)
