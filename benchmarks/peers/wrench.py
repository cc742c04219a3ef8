"""The magnetism callback with magpylib."""

from collections.abc import Callable
from typing import Any

import magpylib

import magmotor as mm

Callback = Callable[[Any, Any], None]


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
