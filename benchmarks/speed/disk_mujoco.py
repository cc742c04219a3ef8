"""Cost of a step of the sliding disk in MuJoCo, compared with the variational engine."""

import ctypes
from functools import partial

import mujoco
from numba import njit

import magmotor as mm
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of
from magmotor.device.job import Job
from magmotor.devices.disk.states import start_disk
from magmotor.devices.disk.variational import run
from magmotor.mjcf.hooks import without_stopwatch
from magmotor_plugin.library import library

TIMESTEP = 0.01
STEPS = 20_000
FLAT, WELL = mm.Disk(noise=0.0, potential="flat"), mm.Disk(noise=0.0)
DRIVEN = mm.Disk()
NO_FRICTION = mm.Disk(noise=0.0, potential="flat", friction=0.0)
EULER, RK4 = mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_RK4
CASES = {
    "no friction, callback off": (NO_FRICTION, EULER, False),
    "friction, callback off": (FLAT, EULER, False),
    "friction and potential": (WELL, EULER, True),
    "friction and noise": (mm.Disk(potential="flat"), EULER, True),
    "the paper's disk": (DRIVEN, EULER, True),
    "the paper's disk, by contact": (DRIVEN.replace(surface="plane"), EULER, True),
    "the paper's disk, RK4": (DRIVEN, RK4, True),
}
NOTE = """\
One replica, 20 000 steps inside one call, Euler unless stated, against variational/euler on the
  same path, which steps 8 replicas, in the lanes of a vector, at the cost of one. MuJoCo's time is
  that of its pipeline for one body: see below."""
PARTS = (
    ("mj_fwdPosition", "positions, inertia, tendon"),
    ("mj_fwdVelocity", "velocities, friction, bias"),
    ("callback", "noise and potential"),
    ("mj_fwdAcceleration", "forces to accelerations"),
    ("mj_fwdConstraint", "no constraints"),
    ("mj_Euler", "moving on"),
)
PARTS_NOTE = """\
The paper's disk, planar; each part called through its C pointer in a compiled loop. Called alone, a
  part overlaps in the processor with its own next call; in sequence each waits for the last one."""
PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64)


def main() -> None:
    cases = {name: _stepper(*case) for name, case in CASES.items()}
    times = in_turns(cases | {"variational": partial(_variational, DRIVEN)}, turns=20)
    rows = [Row(name, times[name], times["variational"]) for name in CASES]
    show("The disk's step in MuJoCo", NOTE, ("MuJoCo", "variational", "ratio"), rows)
    _show_parts()


def _show_parts() -> None:
    model = mm.build(DRIVEN)
    model.opt.timestep = TIMESTEP
    data = mujoco.MjData(model)
    in_c = library()
    calls = {name: getattr(in_c, name) for name, _ in PARTS if name != "callback"}
    with mm.magnetism(), without_stopwatch():
        calls |= {"callback": mujoco.get_mjcb_control(), "mj_step": in_c.mj_step}
        cases, pointers = {}, {}
        for name, function in calls.items():
            call = ctypes.cast(function, PROTOTYPE)
            cases[name] = partial(_seconds_a_call, _call_often, (call,), model, data)
            pointers[name] = call
        sequence = tuple(pointers[name] for name, _ in PARTS)
        cases["all"] = partial(_seconds_a_call, _call_in_sequence, sequence, model, data)
        times = in_turns(cases, turns=20)
    rows = [Row(f"{what} ({name})", times[name], times["mj_step"]) for name, what in PARTS]
    rows.append(Row("these six in sequence", times["all"], times["mj_step"]))
    show("Where the time goes", PARTS_NOTE, ("part", "mj_step", "ratio"), rows)


@njit
def _call_often(model, data, count, call):
    for _ in range(count):
        call(model, data)


@njit
def _call_in_sequence(m, d, count, position, velocity, driving, acceleration, constraint, euler):
    for _ in range(count):
        position(m, d)
        velocity(m, d)
        driving(m, d)
        acceleration(m, d)
        constraint(m, d)
        euler(m, d)


def _seconds_a_call(repeat, calls, model: mujoco.MjModel, data: mujoco.MjData) -> float:
    mujoco.mj_resetData(model, data)
    mujoco.mj_forward(model, data)
    return seconds_of(partial(repeat, model._address, data._address, STEPS, *calls)) / STEPS


def _stepper(scene: mm.Disk, integrator: mujoco.mjtIntegrator, driven: bool):
    model = mm.build(scene)
    model.opt.timestep, model.opt.integrator = TIMESTEP, integrator
    data = mujoco.MjData(model)
    steps = partial(mujoco.mj_step, model, data, nstep=STEPS)

    def step() -> float:
        mujoco.mj_resetData(model, data)
        data.qvel[:] = 1.0
        with without_stopwatch():
            if not driven:
                return seconds_of(steps) / STEPS
            with mm.magnetism():
                return seconds_of(steps) / STEPS

    return step


def _variational(scene: mm.Disk) -> float:
    path = mm.noise.BrownianPath(0, TIMESTEP)
    job = Job(scene, "euler", TIMESTEP, 1, STEPS, start_disk(scene), path, 0)
    return seconds_of(lambda: list(run(job))) / STEPS
