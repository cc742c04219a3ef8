"""Cost that magnetism adds to MuJoCo's step."""

from functools import partial

import mujoco

import magmotor as mm
from benchmarks.harness.stepping import Stepper
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns
from magmotor.common.environment import data_folder

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
Both step the same model from the same state in motion, 2000 steps inside one mj_step; on the bare
  one, no magnetic force acts. MuJoCo's timers run, as they do for a user; `simulate` stops them.
  The motor's noise counts as magnetism."""


BY_PLUGIN = {
    "planar, 20 dipoles": ("top", 1.1),
    "plane, 20 dipoles": ("top_plane", 1.1),
    "motor, 125 pairs": ("motor", 1.1),
    "disk, noise and potential": ("disk", 1.1),
}
"""The scenes of `models/`, and the largest admissible ratio."""

PLUGIN_NOTE = """\
The same scene with the engine plugin and with the callback, from the same state."""


def main() -> None:
    _compare_with_bare_steps()
    _compare_with_plugin()


def _compare_with_plugin() -> None:
    cases = {}
    for name, (scene, _) in BY_PLUGIN.items():
        plain, plugin = (
            Stepper(mujoco.MjModel.from_xml_path(str(data_folder("models") / f"{file}.xml")))
            for file in (scene, f"{scene}_magnetic")
        )
        cases[name, "plugin"] = partial(plugin.seconds, magnetic=False)
        cases[name, "callback"] = partial(plain.seconds, magnetic=True)
    times = in_turns(cases, turns=60)
    rows = [
        Row(name, times[name, "plugin"], times[name, "callback"], at_most)
        for name, (_, at_most) in BY_PLUGIN.items()
    ]
    show("Plugin against callback", PLUGIN_NOTE, ("plugin", "callback", "ratio"), rows)


def _compare_with_bare_steps() -> None:
    steppers = {name: Stepper(mm.build(scene)) for name, scene in SCENES.items()}
    cases = {
        (name, magnetic): partial(stepper.seconds, magnetic=magnetic, stopwatch_runs=True)
        for name, stepper in steppers.items()
        for magnetic in (True, False)
    }
    times = in_turns(cases, turns=60)
    rows = [Row(name, times[name, True], times[name, False], AT_MOST.get(name)) for name in SCENES]
    show("Magnetized step against bare step", NOTE, ("magnetized", "bare", "ratio"), rows)
