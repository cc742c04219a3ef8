"""What must hold on any model with a temperature."""

import copy
import warnings
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

import magmotor as mm
from corpus.models import Skipped, digest, opened, start

FLAGS = ("density", "contact", "frictionloss", "actuation", "limit", "equality", "spring", "damper")
"""Flags that may be disabled for a thermostat, those that most models need first."""

STEPS = 1500
BURN = 300
STRIDE = 0.02
"""Motion of the fastest joint in a step, rad or m, which sets the temperature."""

SPREAD = 30
"""Random configurations at which forces are compared."""

ROUNDING = 1e-9


@dataclass
class Findings:
    """What was found on a model."""

    file: Path
    skipped: str = ""
    digest: str = ""
    repeated: bool = False
    as_is: bool = False
    """Whether the thermostat takes the model as it is, friction included."""
    first: str = ""
    """The reason why not."""
    flags: tuple[str, ...] = ()
    """Flags without which it does not."""
    given: bool = False
    """Whether friction must be given, since nothing is damped."""
    refused: str = ""
    """Reason why not even with all flags disabled."""
    broken: str = ""
    """Error in the run."""
    reasons: dict[str, str] = field(default_factory=dict)
    """For each flag, the message if all others are disabled."""
    nv: int = 0
    forces: float = np.nan
    loop: float = np.nan
    friction: float = np.nan
    stable: float = np.nan
    """Timestep times the highest frequency."""
    limits: float = np.nan
    """The same beyond limits."""
    timestep: float = np.nan
    energy: float = np.nan
    temperature: float = np.nan
    sigma: float = np.nan
    seconds: float = np.nan
    """Time of a step, over MuJoCo's."""


def examine(path: Path, seed: int = 0) -> Findings:
    found = Findings(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            _, model = opened(path)
        except Skipped as reason:
            found.skipped = str(reason)
            return found
        found.digest, found.nv = digest(model), model.nv
        try:
            accept(model, found)
            if not found.refused:
                check(model, found, seed)
        except Exception as error:
            found.broken = f"{type(error).__name__}: {error}"
    return found


@contextmanager
def density_kept(model):
    density = model.opt.density
    try:
        yield
    finally:
        model.opt.density = density


def attempt(model, disable, friction=None, kT=1.0):
    """Thermostat, and whether friction had to be given."""
    if "density" in disable:
        model.opt.density = 0
    disable = [flag for flag in disable if flag != "density"]
    try:
        return mm.Langevin(model, kT=kT, disable=disable, friction=friction), False
    except ValueError as error:
        if "must damp something" not in str(error):
            raise
        return mm.Langevin(model, kT=kT, disable=disable, friction=1.0), True


def accept(model, found):
    """Find the flags that must be disabled."""
    try:
        _, found.given = attempt(model, ())
        found.as_is = not found.given
        return
    except ValueError as error:
        found.first = str(error)
    try:
        with density_kept(model):
            attempt(model, FLAGS)
    except ValueError as error:
        found.refused = str(error)
        return
    needed = list(FLAGS)
    for flag in FLAGS[::-1]:
        without = [f for f in needed if f != flag]
        try:
            with density_kept(model):
                attempt(model, without)
            needed = without
        except ValueError as error:
            found.reasons[flag] = str(error)
    _, found.given = attempt(model, needed)
    found.flags = tuple(needed)


def with_flags(model, flags):
    """Copy of a model with features disabled, for MuJoCo's own functions."""
    own = copy.copy(model)
    for flag in (*set(flags) - {"density"}, "refsafe"):
        own.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}"))
    welds = own.eq_type == int(mujoco.mjtEq.mjEQ_WELD)
    own.eq_solimp[welds, 1] = own.eq_solimp[welds, 0]
    own.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    own.opt.density = 0
    return own


def moved(model, data, rng, size):
    """Random configuration near that of data."""
    mujoco.mj_integratePos(model, data.qpos, size * rng.standard_normal(model.nv), 1.0)


def expected_forces(own, data):
    """MuJoCo's forces at rest without noise, those of soft constraints included."""
    data.qvel[:] = 0
    mujoco.mj_forward(own, data)
    total = data.qfrc_smooth.copy()
    if data.nefc:
        total += data.efc_J.reshape(data.nefc, -1).T @ (data.efc_D * data.efc_aref)
    return total


def frequency(model, langevin, data):
    """Highest angular frequency of forces at a configuration, or growth rate."""
    qpos = data.qpos.copy()
    stiff = np.empty((model.nv, model.nv))
    step = 1e-5
    for i in range(model.nv):
        sides = []
        for sign in (1, -1):
            data.qpos[:] = qpos
            move = np.zeros(model.nv)
            move[i] = sign * step
            mujoco.mj_integratePos(model, data.qpos, move, 1.0)
            sides.append(langevin.forces(data))
        stiff[:, i] = (sides[1] - sides[0]) / (2 * step)
    data.qpos[:] = qpos
    langevin.forces(data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    values = np.linalg.eigvals(np.linalg.solve(inertia, stiff))
    return float(np.sqrt(np.max(np.abs(values))))


def loop_work(model, langevin, data, rng, size, points=400):
    """Work around a closed path, over the total."""
    qpos = data.qpos.copy()
    a, b = size * rng.standard_normal((2, model.nv))
    path, forces = [], []
    for s in np.arange(points) / points * 2 * np.pi:
        data.qpos[:] = qpos
        mujoco.mj_integratePos(model, data.qpos, a * np.sin(s) + b * (1 - np.cos(s)), 1.0)
        path.append(data.qpos.copy())
        forces.append(langevin.forces(data))
    data.qpos[:] = qpos
    works = []
    difference = np.zeros(model.nv)
    for k in range(points):
        n = (k + 1) % points
        mujoco.mj_differentiatePos(model, difference, 1.0, path[k], path[n])
        works.append(difference @ (forces[k] + forces[n]) / 2)
    works = np.array(works)
    return abs(works.sum()) / max(np.abs(works).sum(), 1e-300)


def check(model, found, seed):
    import time

    rng = np.random.default_rng(seed)
    langevin, _ = attempt(model, found.flags)
    own = with_flags(model, found.flags)
    data, other = start(model), start(own)
    if model.na:
        data.act[:] = other.act[:] = 0
    worst = 0.0
    for k in range(SPREAD):
        other = start(own)
        moved(model, other, rng, [0.0, 0.01, 0.1, 1.0][k % 4] if k else 0.0)
        data.qpos[:] = other.qpos
        expected = expected_forces(own, other)
        got = langevin.forces(data)
        parts = other.qfrc_passive, other.qfrc_bias, other.qfrc_actuator, expected
        scale = max(np.abs(parts).max(), 1e-3 * model.body_mass.sum())
        worst = max(worst, np.abs(got - expected).max() / scale)
    found.forces = worst
    data = start(model)
    found.loop = max(loop_work(model, langevin, data, rng, s) for s in (0.03, 0.3))
    h = model.opt.timestep
    found.stable = h * frequency(model, langevin, data)
    for size in (0.3, 1.0):
        moved(model, data, rng, size)
        for i in np.flatnonzero((model.jnt_limited > 0) & (model.jnt_type >= 2)):
            low, high = model.jnt_range[i]
            data.qpos[model.jnt_qposadr[i]] = high + 0.05 if size < 1 else low - 0.05
        found.limits = np.nanmax([found.limits, h * frequency(model, langevin, data)])
    data = start(model)
    # friction
    small = copy.copy(model)
    small.opt.timestep = 1e-14
    own.opt.timestep = 1e-14
    own.opt.integrator = 0
    worst = 0.0
    cold, given = attempt(small, found.flags, kT=0.0)
    if not given:
        for k in range(8):
            d = start(small)
            d.qpos[:] = data.qpos
            moved(model, d, rng, [0.01, 0.1, 0.5][k % 3])
            v = rng.standard_normal(model.nv)
            other.qpos[:] = d.qpos
            other.qvel[:] = 0
            mujoco.mj_forward(own, other)
            rest = other.qfrc_passive + other.qfrc_actuator
            other.qvel[:] = v
            mujoco.mj_forward(own, other)
            power = v @ (other.qfrc_passive + other.qfrc_actuator - rest)
            if other.nefc:
                jac = other.efc_J.reshape(other.nefc, -1)
                aref = other.efc_aref.copy()
                other.qvel[:] = -v
                mujoco.mj_forward(own, other)
                power += np.sum(other.efc_D * (aref - other.efc_aref) * (jac @ v)) / 2
            d.qvel[:] = v
            heat = cold.step(d)["kT"] / 1e-14
            worst = max(worst, abs(heat - power) / max(abs(power), 1e-12))
        found.friction = worst
    # a run
    inertia = np.zeros((model.nv, model.nv))
    langevin.forces(data)
    mujoco.mj_fullM(model, data, inertia)
    run = copy.copy(model)
    fastest = max(found.stable, found.limits)
    if fastest > 0.5:
        run.opt.timestep = 0.5 * h / fastest
    h = found.timestep = run.opt.timestep
    kT = (STRIDE / h) ** 2 * np.diag(inertia).min()
    for friction in (0.2 / h, None):
        if friction is None and found.given:
            continue
        flags = (*set(found.flags) - {"density"}, "gravity") if friction else (*set(found.flags) - {"density"},)
        thermostat = mm.Langevin(run, kT=kT, disable=flags, friction=friction)
        d = start(run)
        begin = d.qvel.copy()
        before = kinetic(run, d, thermostat)
        exchanged = thermostat.step(d, BURN)
        total = sum(exchanged.values())
        size = abs(exchanged["kT"]) + abs(exchanged["work"])
        sums = []
        t0 = time.perf_counter()
        for _ in range(STEPS // 5 if friction else 60):
            exchanged = thermostat.step(d, 5)
            total += sum(exchanged.values())
            size += abs(exchanged["kT"]) + abs(exchanged["work"])
            sums.append(kinetic(run, d, thermostat))
        change = sums[-1] - before
        energy = abs(total - change) / (size + abs(change))
        found.energy = np.nanmax([found.energy, energy])
        if friction:
            found.seconds = (time.perf_counter() - t0) / STEPS
            found.temperature = 2 * np.mean(sums) / model.nv / kT
            found.sigma = np.sqrt(2 / model.nv / (STEPS * 0.2))


def kinetic(model, data, langevin):
    langevin.forces(data)
    product = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, product, data.qvel)
    return 0.5 * data.qvel @ product
