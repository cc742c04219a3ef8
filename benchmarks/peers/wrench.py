"""The magnetism callback in other implementations: in NumPy, and with magpylib."""

import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import magpylib

import magmotor as mm

Callback = Callable[[Any, Any], None]
TESTS = Path(__file__).parents[2] / "tests"


def in_numpy() -> Callback:
    """Return the NumPy implementation with which the tests compare the compiled callback."""
    (twin,) = TESTS.rglob("numpy_twin.py")
    return runpy.run_path(str(twin))["apply_magnetism"]


def by_magpylib(scene: mm.Top) -> Callback:
    """Return a callback for the top's ball, from a collection of the ring's dipoles."""
    sources = zip(*scene.ring_sources(), strict=True)
    ring = magpylib.Collection(
        *(magpylib.misc.Dipole(position=place, moment=moment) for place, moment in sources)
    )
    ball = magpylib.misc.Dipole(moment=(0, 0, scene.moment))

    def apply(model: Any, data: Any) -> None:
        body = data.body("ball")
        ball.position, ball.moment = body.xpos, scene.moment * body.xmat[2::3]
        body.xfrc_applied[:3], body.xfrc_applied[3:] = magpylib.getFT(ring, ball)

    return apply
