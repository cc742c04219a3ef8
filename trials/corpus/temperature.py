"""What must hold on any model that has a temperature."""

import copy
import math
import time
import warnings
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

import magmotor as mm
from trials.corpus.models import Skipped, digest, opened, start

FLAGS = ("contact", "actuation", "frictionloss", "equality", "limit", "spring", "damper")
"""Flags that are disabled if need be."""

FLUID = "density"
"""Stands for the density of the fluid, which no flag makes zero; `spring` and `damper` would."""

CONFIGURATIONS, POINTS = 12, 200
"""Random positions, and points of a closed path."""

INSTANT = 1e-18
"""Timestep in s in which dampers with rates of 1e10 /s do nothing else."""

STEPS, BEFORE, RATE = 1500, 1500, 0.2
"""Steps of a run, those before it, and its friction per step."""

STRIDE, SMALL = 0.02, 0.2
"""Thermal motion of the fastest velocity in a step; largest timestep times frequency."""

SIGMAS = 5.5
"""Largest deviation of a temperature, in standard errors; 4e-8 of normal deviates exceed it."""

BOUNDS = {"forces": 5e-12, "loop": 3e-2, "friction": 3e-8, "energy": 5e-13, "temperature": SIGMAS}
"""Measured: 2.1e-13, 1.1e-3, 1.2e-9, 2.3e-14, 3.4."""


@dataclass
class Findings:
    """What was found on a model. Deviations are relative."""

    file: Path
    skipped: str = ""
    """Why nothing was checked."""
    digest: str = ""
    repeated: bool = False
    """Whether another file has the same compiled model."""
    flags: tuple[str, ...] = ()
    """What must be disabled for the thermostat, each for itself."""
    reasons: dict[str, str] = field(default_factory=dict)
    """The error if everything but this is disabled."""
    undamped: bool = False
    """Whether the friction must be given."""
    refused: str = ""
    """The error if everything is disabled."""
    failed: str = ""
    """Another error."""
    forces: float = math.nan
    """Deviation of the forces at rest from those of MuJoCo."""
    loop: float = math.nan
    """Work of these on closed paths, over the sum of its amounts."""
    friction: float = math.nan
    """Deviation of the heat at zero temperature from the power of MuJoCo's own dampers."""
    energy: float = math.nan
    """Heat and work less the change of the kinetic energy, over the sum of their amounts."""
    temperature: float = math.nan
    """Deviation of the kinetic temperature in standard errors."""
    fastest: float = math.nan
    """Highest frequency, also beyond the limits of joints, times the model's own timestep."""
    stiffest: float = math.nan
    """The same if the flag refsafe is disabled, so that no constraint is softened."""
    cost: float = math.nan
    """Seconds of a step."""

    @property
    def is_checked(self) -> bool:
        return not (self.skipped or self.repeated)

    @property
    def wrong(self) -> str:
        """What should not be."""
        found = {name: getattr(self, name) for name in BOUNDS}
        return self.failed or ", ".join(
            f"{name} {x:.1e}" for name, x in found.items() if x > BOUNDS[name]
        )


def examine(path: Path, seed: int = 0) -> Findings:
    """Check one file."""
    found = Findings(path)
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", UserWarning
        )  # of the compiler, and that limits are softened
        try:
            _, model = opened(path)
        except Skipped as reason:
            found.skipped = str(reason)
            return found
        found.digest = digest(model)
        try:
            model = accepted(model, found)
            if model is not None:
                check(model, found, np.random.default_rng(seed))
        except Exception as error:
            found.failed = f"{type(error).__name__}: {error}"
    return found


def accepted(model: mujoco.MjModel, found: Findings) -> mujoco.MjModel | None:
    """Find out what must be disabled; return the model without it, or None if that is in vain."""
    needed = [FLUID, *FLAGS]
    try:
        thermostat(without(model, needed))
    except ValueError as error:
        found.refused = str(error)
        return None
    for flag in (*FLAGS[::-1], FLUID):
        fewer = [each for each in needed if each != flag]
        try:
            thermostat(without(model, fewer))
            needed = fewer
        except ValueError as error:
            found.reasons[flag] = str(error)
    found.flags = tuple(needed)
    model = without(model, needed)
    found.undamped = thermostat(model)[1]
    return model


def without(model: mujoco.MjModel, flags: Collection[str]) -> mujoco.MjModel:
    """Return a copy of a model in which some features are disabled."""
    own = copy.copy(model)
    for flag in flags:
        if flag == FLUID:
            own.opt.density = 0
        else:
            own.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}"))
    return own


def thermostat(model: mujoco.MjModel, kT: float = 1.0) -> tuple[mm.Langevin, bool]:
    """Return the thermostat, and whether the friction had to be given."""
    try:
        return mm.Langevin(model, kT=kT), False
    except ValueError as error:
        if "must damp something" not in str(error):
            raise
        return mm.Langevin(model, kT=kT, friction=1.0), True


def check(model: mujoco.MjModel, found: Findings, rng: np.random.Generator) -> None:
    found.fastest = model.opt.timestep * highest_frequency(model, thermostat(model)[0], rng)
    model = without(model, ["refsafe"])
    langevin, undamped = thermostat(model)
    found.forces = force_deviation(model, langevin, rng)
    found.loop = max(loop_work(model, langevin, rng, size) for size in (0.03, 0.3))
    if not undamped:
        found.friction = friction_deviation(model, rng)
    found.stiffest = model.opt.timestep * highest_frequency(model, langevin, rng)
    run(model, found)


def of_mujoco(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a model whose constraints at rest are those of the thermostat."""
    own = copy.copy(model)
    welds = own.eq_type == int(mujoco.mjtEq.mjEQ_WELD)
    own.eq_solimp[welds, 1] = own.eq_solimp[welds, 0]
    own.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    return own


def move(model: mujoco.MjModel, data: mujoco.MjData, step: np.ndarray) -> None:
    mujoco.mj_integratePos(model, data.qpos, step, 1.0)


def random_sizes(rng: np.random.Generator, model: mujoco.MjModel) -> list[np.ndarray]:
    """Random moves of all sizes; at the start, some joints are exactly at their limits."""
    sizes = np.resize([0.01, 0.1, 1.0], CONFIGURATIONS)
    return [size * rng.standard_normal(model.nv) for size in sizes]


def force_deviation(
    model: mujoco.MjModel, langevin: mm.Langevin, rng: np.random.Generator
) -> float:
    """Deviation from MuJoCo's forces at zero velocity, with those of soft constraints at rest."""
    own, worst = of_mujoco(model), 0.0
    for step in random_sizes(rng, model):
        data, expected = start(model), start(own)
        for each in (data, expected):
            move(model, each, step)
            each.qvel[:] = 0
        mujoco.mj_forward(own, expected)
        total = expected.qfrc_smooth + constraint_forces(own, expected)
        parts = expected.qfrc_passive, expected.qfrc_bias, expected.qfrc_actuator, total
        size = max(np.max(np.abs(parts)), 1e-3 * model.body_mass.sum())
        worst = max(worst, float(np.max(np.abs(langevin.forces(data) - total)) / size))
    return worst


def constraint_forces(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Generalized forces of soft constraints if nothing accelerates."""
    rows = data.efc_J.reshape(data.nefc, model.nv)
    return rows.T @ (data.efc_D * data.efc_aref)


def loop_work(
    model: mujoco.MjModel, langevin: mm.Langevin, rng: np.random.Generator, size: float
) -> float:
    """Work of the forces on a random closed path, zero if they have a potential."""
    first, second = size * rng.standard_normal((2, model.nv))
    data = start(model)
    origin, path, forces = data.qpos.copy(), [], []
    for angle in 2 * np.pi * np.arange(POINTS + 1) / POINTS:
        data.qpos[:] = origin
        move(model, data, first * np.sin(angle) + second * (1 - np.cos(angle)))
        path.append(data.qpos.copy())
        forces.append(langevin.forces(data))
    works, step = [], np.empty(model.nv)
    for k in range(POINTS):
        mujoco.mj_differentiatePos(model, step, 1.0, path[k], path[k + 1])
        works.append(step @ (forces[k] + forces[k + 1]) / 2)
    return abs(sum(works)) / max(sum(map(abs, works)), 1e-300)


def friction_deviation(model: mujoco.MjModel, rng: np.random.Generator) -> float:
    """Deviation of the heat of a very short step at zero temperature."""
    own, brief, worst = of_mujoco(model), copy.copy(model), 0.0
    brief.opt.timestep = INSTANT
    langevin, _ = thermostat(brief, kT=0.0)
    for step in random_sizes(rng, model):
        data, expected = start(brief), start(own)
        velocity = rng.standard_normal(model.nv)
        powers = []
        for sign in (1, -1):
            expected.qpos[:] = data.qpos
            move(own, expected, step)
            expected.qvel[:] = sign * velocity
            mujoco.mj_forward(own, expected)
            total = expected.qfrc_passive + expected.qfrc_actuator
            powers.append(velocity @ (total + constraint_forces(own, expected)))
        move(model, data, step)
        data.qvel[:] = velocity
        power = (powers[0] - powers[1]) / 2
        heat = langevin.step(data)["kT"] / INSTANT
        worst = max(worst, abs(heat - power) / max(abs(power), 1e-12))
    return worst


def highest_frequency(
    model: mujoco.MjModel, langevin: mm.Langevin, rng: np.random.Generator
) -> float:
    """Highest angular frequency at the start, and where limited joints are beyond their limits."""
    slides_or_turns = model.jnt_type >= int(mujoco.mjtJoint.mjJNT_SLIDE)
    limited = np.flatnonzero((model.jnt_limited > 0) & slides_or_turns)
    highest = 0.0
    for side in (None, 0, 1):
        data = start(model)
        if side is not None:
            move(model, data, rng.standard_normal(model.nv))
            outside = model.jnt_range[limited, side] + (2 * side - 1) * 0.05
            data.qpos[model.jnt_qposadr[limited]] = outside
        highest = max(highest, frequency(model, langevin, data))
    return highest


def frequency(model: mujoco.MjModel, langevin: mm.Langevin, data: mujoco.MjData) -> float:
    """Highest frequency, or rate, of small motions about a position."""
    origin, stiffness = data.qpos.copy(), np.empty((model.nv, model.nv))
    for row, unit in zip(stiffness, 1e-5 * np.eye(model.nv), strict=True):
        sides = []
        for step in (unit, -unit):
            data.qpos[:] = origin
            move(model, data, step)
            sides.append(langevin.forces(data))
        row[:] = (sides[1] - sides[0]) / 2e-5
    data.qpos[:] = origin
    accelerations = np.linalg.solve(inertia(model, langevin, data), stiffness)
    return float(np.sqrt(np.max(np.abs(np.linalg.eigvals(accelerations)))))


def inertia(model: mujoco.MjModel, langevin: mm.Langevin, data: mujoco.MjData) -> np.ndarray:
    """The inertia M at a position."""
    langevin.forces(data)
    matrix = np.empty((model.nv, model.nv))
    for row, unit in zip(matrix, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    return matrix


def run(model: mujoco.MjModel, found: Findings) -> None:
    """Run without weight at a stable timestep and high friction, which soon has the temperature."""
    model = without(model, ["gravity"])
    model.opt.timestep *= min(1.0, SMALL / max(found.stiffest, 1e-300))
    data = start(model)
    lightest = np.diag(inertia(model, thermostat(model)[0], data)).min()
    kT = lightest * (STRIDE / model.opt.timestep) ** 2
    langevin = mm.Langevin(model, kT=kT, friction=RATE / model.opt.timestep)
    energies, exchanged = [kinetic_energy(model, langevin, data)], []
    for steps in (BEFORE, *[5] * (STEPS // 5)):
        begin = time.perf_counter()
        exchanged += langevin.step(data, steps).values()
        found.cost = (time.perf_counter() - begin) / steps
        energies.append(kinetic_energy(model, langevin, data))
    change = energies[-1] - energies[0]
    found.energy = abs(sum(exchanged) - change) / (sum(map(abs, exchanged)) + energies[0])
    mean = 2 * np.mean(energies[2:]) / (model.nv * kT)
    found.temperature = float(abs(mean - 1) / np.sqrt(2 / (model.nv * STEPS * RATE)))


def kinetic_energy(model: mujoco.MjModel, langevin: mm.Langevin, data: mujoco.MjData) -> float:
    langevin.forces(data)
    momentum = np.empty(model.nv)
    mujoco.mj_mulM(model, data, momentum, data.qvel)
    return float(momentum @ data.qvel / 2)
