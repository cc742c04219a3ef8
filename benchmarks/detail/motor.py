"""Cost and effect of the parts of the motor's model, with `mujoco/baoab`.

Rings with another number of dipoles have the same total moment as the paper's.
"""

from collections.abc import Callable
from functools import cache, partial

import mujoco
import numpy as np
from numpy.typing import NDArray

import magmotor as mm
from benchmarks.harness.records import Case, Record
from benchmarks.harness.tables import cost_cells, number, table
from benchmarks.harness.timing import compare, seconds_of
from magmotor.devices.motor.parameters import LARGEST_TILT
from magmotor.mjcf.hooks import without_stopwatch
from magmotor.run.in_mujoco import compose

Array = NDArray[np.float64]
MOTOR = mm.Motor()
TIMESTEP, DURATION, SEED = 0.1, 500.0, 7
STEPS, LONG = 3000, 200_000


@cache
def valley() -> float:
    """Return the radius of the valley, in m."""
    return mm.observables.motor_wells(MOTOR).radius


def _thinned(count: int) -> mujoco.MjModel:
    model = mm.build(MOTOR.replace(inner_dipoles=count))
    sites = model.site_bodyid == model.body("inner_ring").id
    model.site_user[sites, 0] *= MOTOR.inner_dipoles / count
    return model


def _rings_apart() -> mujoco.MjModel:
    root = compose(MOTOR, visual=False)
    pair = root.custom.add("tuple", name="coupling_of_rings")
    for body in ("inner_ring", "outer_ring"):
        pair.add("element", objtype="body", objname=body, prm=0)
    return mujoco.MjModel.from_xml_string(root.to_xml_string())


def _sparse() -> mujoco.MjModel:
    model = mm.build(MOTOR)
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    return model


PARTS: dict[str, Callable[[], mujoco.MjModel]] = {
    "as it is, 20 dipoles on the inner ring": partial(mm.build, MOTOR),
    "5 dipoles": partial(_thinned, 5),
    "10 dipoles": partial(_thinned, 10),
    "15 dipoles": partial(_thinned, 15),
    "40 dipoles": partial(_thinned, 40),
    "80 dipoles": partial(_thinned, 80),
    "without what the rings do to one another": _rings_apart,
    "without noise": partial(mm.build, MOTOR.replace(alpha_ball=0.0, alpha_ring=0.0)),
    "sparse Jacobian": _sparse,
    "with lights, cameras and decoration": partial(mm.build, MOTOR, visual=True),
}
RUNS = {
    "mujoco/baoab by `simulate`, each step kept": ("mujoco/baoab", 1, "mujoco/baoab"),
    "variational/baoab by `simulate`, each step kept": (
        "variational/baoab",
        1,
        "variational/baoab",
    ),
    "variational/euler beside variational/baoab": ("variational/euler", 100, "variational/baoab"),
    "variational/cayley beside variational/euler": ("variational/cayley", 100, "variational/euler"),
}
"""Method, record interval, and the method for comparison, which keeps each 100th step."""


def cases(quick: bool) -> list[Case]:
    turns = 10 if quick else 60
    parts = [Case(f"detail/motor/{name}", partial(_part, name, turns), 1.5) for name in PARTS]
    runs = [
        Case(f"detail/motor/{name}", partial(_run, *RUNS[name], turns // 12 + 1), 5)
        for name in RUNS
    ]
    return parts + runs


def _part(name: str, turns: int) -> Record:
    model = PARTS[name]()
    record = compare(_stepper(model), _stepper(mm.build(MOTOR)), turns)
    level = [potential(model, azimuth, 0.0) for azimuth in (0.0, np.pi / MOTOR.outer_dipoles)]
    spacing = 2 * np.pi / np.sum(model.site_bodyid == model.body("inner_ring").id)
    turned = [potential(model, 0.0, angle) for angle in spacing * np.linspace(0, 1, 33)]
    record["barrier"] = (level[1] - level[0]) / MOTOR.kT
    record["ripple"] = float(np.ptp(turned)) / MOTOR.kT
    record["stiffness"] = stiffness(model)
    try:
        record["moved"] = _distance(path(model), _usual_path())
    except ArithmeticError as failure:
        record["failed"] = str(failure)
    return record


def _stepper(model: mujoco.MjModel) -> Callable[[], float]:
    """Return a function that measures a step of BAOAB."""
    model.opt.timestep = TIMESTEP
    langevin, data = mm.Langevin(model), mujoco.MjData(model)

    def seconds() -> float:
        mujoco.mj_resetDataKeyframe(model, data, 0)
        data.userdata[0] = SEED
        with without_stopwatch():
            return seconds_of(partial(langevin.step, data, nstep=STEPS)) / STEPS

    return seconds


def potential(model: mujoco.MjModel, azimuth: float, angle: float) -> float:
    """Compute V_e of the ball in the valley, in J, under a level ring rotated about its axis."""
    data = _with_ring(model, [np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])
    inner = model.site_bodyid == model.body("inner_ring").id
    moment = model.site_user[:, 0] * np.where(inner, MOTOR.ball_ring_factor, 1.0)
    sources = model.site_bodyid != model.body("ball").id
    moments = moment[:, np.newaxis] * data.site_xmat[:, 2::3]
    position = [valley() * np.cos(azimuth), valley() * np.sin(azimuth), MOTOR.ball_radius]
    field = mm.dipoles.field(position, data.site_xpos[sources], moments[sources])
    return -MOTOR.moment * float(np.linalg.norm(field))


def stiffness(model: mujoco.MjModel, angle: float = 1e-3) -> float:
    """Compute the stiffness of the tilted ring, in N m/rad, with the ball at its start."""
    torques = []
    for half in (angle / 2, -angle / 2):
        data = _with_ring(model, [np.cos(half), 0.0, np.sin(half), 0.0])
        with mm.magnetism():
            mujoco.mj_forward(model, data)
        torques.append(data.body("inner_ring").xfrc_applied[4])
    return float(torques[1] - torques[0]) / (2 * angle)


def _with_ring(model: mujoco.MjModel, orientation: list[float]) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.joint("inner_ring").qpos[:] = orientation
    mujoco.mj_kinematics(model, data)
    return data


def path(model: mujoco.MjModel) -> Array:
    """Return the ball's position after each step, shape (T, 2), always for the same Brownian path.

    Raises ArithmeticError if the ring tips over.
    """
    model.opt.timestep = TIMESTEP
    langevin, data = mm.Langevin(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.userdata[0] = SEED
    positions = []
    for _ in range(round(DURATION / TIMESTEP)):
        langevin.step(data)
        if data.body("inner_ring").xmat[8] < np.cos(LARGEST_TILT):
            raise ArithmeticError(f"the ring tips over at t = {data.time:.0f} s")
        positions.append(data.qpos[:2].copy())
    return np.array(positions)


def _distance(path: Array, other: Array) -> float:
    """Return the largest distance of two paths, over the valley's radius."""
    return float(np.linalg.norm(path - other, axis=1).max()) / valley()


@cache
def _usual_path() -> Array:
    return path(mm.build(MOTOR))


def _run(method: str, interval: int, other: str, turns: int) -> Record:
    paths = [
        mm.simulate(
            MOTOR, method=name, timestep=TIMESTEP, duration=DURATION, seed=SEED
        ).position.values
        for name in (method, other)
    ]
    cost = compare(partial(_simulate, method, interval), partial(_simulate, other, 100), turns)
    return cost | {"moved": _distance(*paths)}


def _simulate(method: str, interval: int) -> float:
    """Return the seconds per step, over enough steps to make set-up negligible."""
    run = partial(
        mm.simulate, MOTOR, method=method, timestep=TIMESTEP, duration=LONG * TIMESTEP, seed=SEED,
        record_interval=interval,
    )  # fmt: skip
    return seconds_of(run) / LONG


def tabulate(records: dict[str, Record]) -> str:
    columns = [
        "motor", "µs a step", "ratio", "barrier/kT", "ring's ripple/kT",
        "ring's stiffness (N m/rad)", "ball moved in 500 s",
    ]  # fmt: skip
    rows = []
    for name in (*PARTS, *RUNS):
        record = records[f"detail/motor/{name}"]
        found = [number(record.get(name)) for name in ("barrier", "ripple", "stiffness")]
        moved = record.get("failed") or number(record["moved"])
        rows.append([name, *cost_cells(record), *found, moved])
    return table(columns, rows)
