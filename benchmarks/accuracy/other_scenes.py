"""Errors of tops that the charts do not contain, with the method and step recommended for them."""

from functools import partial
from unittest.mock import patch

import magmotor as mm
from benchmarks.accuracy.top import TRUTH, largest_error
from benchmarks.harness.records import Case, Record
from magmotor.run import in_scipy as dop853

DURATION = 60.0

SCENES = {
    "the charted top, case 4": mm.Top.paper(4),
    "initial slip of 0.5 m/s": mm.Top(velocity=(0.5, 0.0)),
    "initial slip of 1 m/s": mm.Top(velocity=(1.0, 0.0)),
    "initial slip of 2 m/s": mm.Top(velocity=(2.0, 0.0)),
    "initial spin of 5 rad/s": mm.Top(spin=5.0),
    "initial spin of 30 rad/s": mm.Top(spin=30.0),
    "ring of 5 dipoles": mm.Top(ring_dipoles=5),
    "ring at half the height": mm.Top(ring_height=0.1),
    "ring tilted by 0.2 rad": mm.Top(tilt=0.2),
    "oblate ball": mm.Top(ball_axial_inertia=3e-5),
    "a tenth of the friction": mm.Top(friction=0.03),
    "ten times the friction": mm.Top(friction=3.0),
    "moments in SI, held down": mm.Top.si(gravity=1e3),
    "scripted ring": mm.Top.experiment(),
}


def cases(quick: bool) -> list[Case]:
    """Return a case for each scene."""
    names = [*SCENES][:2] if quick else SCENES
    return [Case(f"other scene/{name}", partial(_measure, name), 1.0) for name in names]


def _measure(name: str) -> Record:
    scene = SCENES[name]
    choice = mm.recommend(scene)
    with patch.object(dop853, "RELATIVE_TOLERANCE", TRUTH):
        run, truth = (
            mm.simulate(scene, method=method, timestep=choice.timestep, duration=DURATION)
            for method in (choice.method, "scipy/dop853")
        )
    momentum, true = run.momentum_map.values, truth.momentum_map.values
    return {
        "other_scene": name,
        "method": choice.method,
        "timestep": choice.timestep,
        "charted_error": choice.promised,
        "error": largest_error(momentum, true, true),
    }
