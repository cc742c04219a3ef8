"""Cost of a step of BAOAB in MuJoCo, compared with a step of MuJoCo's own Euler."""

import ctypes
from functools import partial

import mujoco
from numba import njit

import magmotor as mm
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of
from magmotor.mjcf.hooks import without_stopwatch
from magmotor.noise import BrownianPath
from magmotor_plugin.library import library

STEPS, TURNS = 3000, 40
CASES = {
    "disk": (mm.Disk(), 0.01, None),
    "top": (mm.Top(), 0.0125, None),
    "motor": (mm.Motor(), 0.1, 0.5),
}
"""Scene, timestep, and target ratio."""

NOTE = "Planar scenes, one thread; Euler inside a block of magnetism, of the same model."

DURATION, RECORD_INTERVAL, LONGEST = 1e5, 10, 10.0
LONG_NOTE = """\
1e5 s of the motor by simulate at h = 0.1 s, every tenth step recorded: a million steps, with their
  heat and work, and the dataset."""

PARTS_NOTE = """\
The motor. Each part is called alone in a compiled loop, so that it overlaps in the processor with
  its own next call. The rest is friction, and transformations between bodies and the world."""

WORD, NUMBER = ctypes.c_int64, ctypes.c_double
ON_DATA = ctypes.CFUNCTYPE(None, WORD, WORD)
ON_POSITIONS = ctypes.CFUNCTYPE(None, WORD, WORD, WORD, NUMBER)


def main() -> None:
    pairs = {name: _steppers(scene, h) for name, (scene, h, _) in CASES.items()}
    cases = {(n, k): stepper for n, pair in pairs.items() for k, stepper in enumerate(pair)}
    with mm.magnetism(), without_stopwatch():
        times = in_turns(cases, TURNS)
    rows = [
        Row(name, times[name, 0], times[name, 1], at_most=target)
        for name, (_, _, target) in CASES.items()
    ]
    show("A step of BAOAB in MuJoCo", NOTE, ("BAOAB", "Euler", "ratio"), rows)
    _show_parts(times["motor", 0])
    _show_long_runs()


def _steppers(scene, timestep: float):
    """Return functions that measure a step by BAOAB and by Euler."""
    model = mm.build(scene)
    model.opt.timestep = timestep
    langevin = mm.Langevin(model)
    steps = (langevin.step, partial(mujoco.mj_step, model))
    return [partial(_seconds_a_step, model, mujoco.MjData(model), step) for step in steps]


def _seconds_a_step(model: mujoco.MjModel, data: mujoco.MjData, step) -> float:
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return seconds_of(partial(step, data, nstep=STEPS)) / STEPS


def _show_parts(whole: list[float]) -> None:
    model = mm.build(mm.Motor())
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    in_c = library()
    kinematics = ctypes.cast(in_c.mj_kinematics, ON_DATA)
    drift = ctypes.cast(in_c.mj_integratePos, ON_POSITIONS)
    both = model._address, data._address
    positions = model._address, data.qpos.ctypes.data, data.qvel.ctypes.data, 1e-9
    with mm.magnetism():
        mujoco.mj_forward(model, data)
        forces = ctypes.cast(mujoco.get_mjcb_control(), ON_DATA)
        cases = {
            "bodies and sites (mj_kinematics)": partial(_seconds_a_call, _call, kinematics, *both),
            "forces and noise (callback)": partial(_seconds_a_call, _call, forces, *both),
            "moving, twice (mj_integratePos)": partial(_seconds_a_call, _drift, drift, *positions),
        }
        times = in_turns(cases, TURNS)
    rows = [Row(name, times[name], whole) for name in cases]
    show("Where its time goes", PARTS_NOTE, ("part", "step", "ratio"), rows)


def _seconds_a_call(repeat, function, *arguments) -> float:
    return seconds_of(partial(repeat, STEPS, function, *arguments)) / STEPS


@njit
def _call(count, function, model, data):
    for _ in range(count):
        function(model, data)


@njit
def _drift(count, function, model, qpos, qvel, duration):
    for _ in range(count):
        function(model, qpos, qvel, duration)
        function(model, qpos, qvel, duration)


def _show_long_runs() -> None:
    rows = []
    for scheme, target in (("baoab", LONGEST), ("euler", None)):
        run = partial(
            mm.simulate, mm.Motor(), method=f"mujoco/{scheme}", timestep=0.1, duration=DURATION,
            record_interval=RECORD_INTERVAL, path=BrownianPath(1, 0.1),
        )  # fmt: skip
        rows.append(Row(f"mujoco/{scheme}", [seconds_of(run)], at_most=target))
    show("A long run of the motor", LONG_NOTE, ("time", "", ""), rows)
