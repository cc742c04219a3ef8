"""Cost that magnetism adds to MuJoCo's step."""

from functools import partial

import magmotor as mm
from benchmarks.harness.stepping import Stepper
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns

SCENES = {
    "planar, 20 dipoles": mm.Top(),
    "planar, 20 dipoles, friction 0": mm.Top(friction=0.0),
    "plane, 20 dipoles": mm.Top(surface="plane"),
    "plane, 20 dipoles, friction 0": mm.Top(surface="plane", friction=0.0),
    "planar, 40 dipoles": mm.Top(ring_dipoles=40),
    "planar, 125 dipoles": mm.Top(ring_dipoles=125),
    "motor, 125 pairs": mm.Motor(),
}
AT_MOST = {"planar, 20 dipoles": 1.15, "motor, 125 pairs": 1.4}
NOTE = """\
Both step the same model from the same state in motion, 2000 steps inside one mj_step; the bare one
  keeps the initial wrench constant. MuJoCo's timers are off: they would lengthen both. The
  motor's noise counts as magnetism."""


def main() -> None:
    steppers = {name: Stepper(mm.build(scene)) for name, scene in SCENES.items()}
    cases = {
        (name, magnetic): partial(stepper.seconds, magnetic=magnetic)
        for name, stepper in steppers.items()
        for magnetic in (True, False)
    }
    times = in_turns(cases, turns=60)
    rows = [Row(name, times[name, True], times[name, False], AT_MOST.get(name)) for name in SCENES]
    show("Magnetized step against bare step", NOTE, ("magnetized", "bare", "ratio"), rows)
