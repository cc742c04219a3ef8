"""The thermostat and the dipoles against independent programs: the same quantity by both.

Each judge runs in an environment of its own, with its own equations and random numbers. Only the
estimates from the recorded motion are common.
"""

import math
from collections.abc import Callable
from functools import partial

import mujoco
import numpy as np
from scipy.special import iv

import magmotor as mm
from benchmarks.harness.records import Case, Record
from benchmarks.harness.tables import number, table
from benchmarks.peers.langevin_estimates import of_bodies, of_particles
from benchmarks.peers.other_environment import answer_of

PARTICLE = {"depth": 1.5, "friction": 1.0, "kT": 1.0, "timestep": 0.125, "every": 2, "lag": 400}
PARTICLE |= {"settle": 800}
BODY = {"mass": 1.0, "moments": [0.8, 1.5, 2.1], "damping": 1.0, "kT": 1.0, "timestep": 0.05}
BODY |= {"every": 20, "lags": {"1": 1}, "settle": 400}
SIZES = {
    "particle": {"replicas": 1500, "records": 4801},
    "body": {"replicas": 1500, "records": 100},
}
QUICK_SIZES = {
    "particle": {"replicas": 60, "records": 801},
    "body": {"replicas": 60, "records": 20},
}
DIPOLES = 64

Estimates = dict[str, list[float]]
"""Means with their standard errors, by the names of quantities."""


def particle(
    depth, friction, kT, timestep, every, records, replicas, lag, settle, seed
) -> Estimates:
    """Let this project move particles on a slide in the potential -depth cos x."""
    model = slide(depth, friction, timestep)
    run = _sample(model, kT, seed, every, records, replicas, settle)
    return of_particles(run.qpos.values[..., 0], every * timestep, lag)


def slide(depth: float, friction: float, timestep: float) -> mujoco.MjModel:
    """Return the model of a unit mass on a slide in the potential -depth cos x."""
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{timestep}" gravity="0 0 0"/>
          <custom><text name="magmotor" data="potentials"/></custom>
          <size nuser_jnt="2"/>
          <worldbody>
            <body>
              <inertial mass="1" diaginertia="1 1 1" pos="0 0 0"/>
              <joint type="slide" axis="1 0 0" damping="{friction}" user="0 {-depth}"/>
            </body>
          </worldbody>
        </mujoco>""")


def body(
    mass, moments, damping, kT, timestep, every, records, replicas, lags, settle, seed
) -> Estimates:
    """Let this project move free bodies with three unequal moments of inertia."""
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{timestep}" gravity="0 0 0"/>
          <worldbody>
            <body>
              <inertial mass="{mass}" diaginertia="{" ".join(map(str, moments))}" pos="0 0 0"/>
              <joint type="free" damping="{damping}"/>
            </body>
          </worldbody>
        </mujoco>""")
    run = _sample(model, kT, seed, every, records, replicas, settle)
    v, omega = np.split(run.qvel.values, 2, axis=-1)
    return of_bodies(
        v, omega, run.qpos.values[..., 3:], mass=mass, moments=np.array(moments), lags=lags
    )


def _sample(model, kT, seed, every, records, replicas, settle):
    langevin = mm.Langevin(model, kT=kT, seed=seed)
    return langevin.sample(
        (every * records) * langevin.timestep,
        replicas=replicas,
        record_interval=every,
        burn_in=settle * langevin.timestep,
    )


OURS: dict[str, Callable[..., Estimates]] = {"particle": particle, "body": body}
QUESTIONS = {"particle": PARTICLE, "body": BODY}
JUDGES = {
    "OpenMM": ("langevin_openmm", "particle"),
    "LAMMPS": ("langevin_lammps", "body"),
    "jax-md": ("langevin_jax_md", "body"),
    "jax-md, noise along the axes": ("langevin_jax_md", "body"),
}
"""Each judge's program, and what it moves; words after a comma are a part of the question."""


def cases(quick: bool) -> list[Case]:
    sizes = QUICK_SIZES if quick else SIZES
    found = [
        Case(f"peers/langevin/ours/{what}", partial(_ours, what, sizes[what]), 2 if quick else 60)
        for what in OURS
    ]
    found += [
        Case(f"peers/langevin/{judge}", partial(_theirs, judge, sizes[what]), 10 if quick else 40)
        for judge, (_, what) in JUDGES.items()
    ]
    return [*found, Case("peers/langevin/dipoles", _dipoles, 2)]


def _ours(what: str, size: dict[str, int]) -> Record:
    return OURS[what](**QUESTIONS[what], **size, seed=1)


def _theirs(judge: str, size: dict[str, int]) -> Record:
    module, what = JUDGES[judge]
    question = what + judge[len(judge.partition(",")[0]) :]
    return answer_of(module, what=question, **QUESTIONS[what], **size, seed=2)


def _dipoles() -> Record:
    """Compare the force and torque on each of some random dipoles by all others."""
    rng = np.random.default_rng(1)
    positions, moments = rng.normal(size=(2, DIPOLES, 3)) * [[[3.0]], [[1.0]]]
    question = {"positions": positions.tolist(), "moments": moments.tolist()}
    theirs = answer_of("langevin_lammps", what="dipoles", **question)
    if "failed" in theirs:
        return theirs
    found = {}
    others = [np.arange(DIPOLES) != k for k in range(DIPOLES)]
    wrenches = [
        mm.dipoles.wrench(positions[k], moments[k], positions[other], moments[other])
        for k, other in enumerate(others)
    ]
    for name, ours in zip(("force", "torque"), zip(*wrenches, strict=True), strict=True):
        ours = np.array(ours) / mm.dipoles.PERMEABILITY_OVER_4PI
        largest = [float(abs(np.array(values)).max()) for values in (theirs[name], ours)]
        difference = float(abs(ours - theirs[name]).max()) / largest[0]
        found[name] = {"largest": largest, "difference": difference}
    return found


def exact() -> dict[str, float]:
    """Return the quantities that theory gives."""
    depth, kT = PARTICLE["depth"], PARTICLE["kT"]
    names = ["of the center", *(f"about axis {axis}" for axis in (1, 2, 3))]
    return {
        "mean of cos x": float(iv(1, depth / kT) / iv(0, depth / kT)),
        "diffusion": exact_diffusion(depth, PARTICLE["friction"], kT),
        "m v(0).v(1)/3": BODY["kT"] * math.exp(-BODY["damping"] / BODY["mass"]),
        **{f"temperature {name}": BODY["kT"] for name in names},
    }


def exact_diffusion(depth: float, friction: float, kT: float) -> float:
    """Return the diffusion coefficient of a unit mass in the potential -depth cos x.

    It is the mean of v phi, where L phi = -v and L is the backward Kolmogorov operator, here in
    Fourier modes of x and Hermite functions of v.
    """
    modes, degrees = 12, 40
    wave, degree = np.arange(-modes, modes + 1), np.arange(degrees)
    lower = np.diag(np.sqrt(degree[1:]), 1)
    slope = 1j * np.diag(wave)
    force = depth * (np.eye(len(wave), k=-1) - np.eye(len(wave), k=1)) / 2j
    root = math.sqrt(kT)
    operator = np.kron(lower.T, root * slope) + np.kron(lower, root * slope - force / root)
    operator -= np.kron(np.diag(friction * degree), np.eye(len(wave)))
    right = np.kron(degree == 1, wave == 0) * -root
    operator[modes] = np.arange(len(right)) == modes  # phi is known up to a constant
    phi = np.linalg.solve(operator, right).reshape(degrees, -1)
    weight = iv(abs(wave), depth / kT) / iv(0, depth / kT)
    return root * float(np.real(phi[1] @ weight))


def tabulate(records: dict[str, Record]) -> str:
    """Return a row for each quantity, and a last row for each judge that is missing."""
    known, rows, missing = exact(), [], []
    theirs = {judge: records[f"peers/langevin/{judge}"] for judge in JUDGES}
    for what in OURS:
        for name, ours in records[f"peers/langevin/ours/{what}"].items():
            cells = [_beside(theirs[judge].get(name), ours) for judge in JUDGES]
            truth = f"{known[name]:.5g}" if name in known else ""
            rows.append([name, truth, with_error(*ours), *cells])
    for name, found in records["peers/langevin/dipoles"].items():
        if name != "failed":
            largest = [f"{value:.6g}" for value in found["largest"]]
            cell = f"{largest[0]}, {number(found['difference'])} of it"
            others = [cell if judge == "LAMMPS" else "" for judge in JUDGES]
            rows.append([f"largest {name} among {DIPOLES} dipoles", "", largest[1], *others])
    for judge, record in theirs.items():
        if "failed" in record:
            missing.append([f"{judge} ({record['failed']})", *[""] * (2 + len(JUDGES))])
    return table(["quantity", "exact", "ours", *JUDGES], [*rows, *missing])


def _beside(theirs: list[float] | None, ours: list[float]) -> str:
    """Return a judge's estimate, and its difference from ours in standard errors of both."""
    if theirs is None:
        return ""
    sigmas = (theirs[0] - ours[0]) / math.hypot(theirs[1], ours[1])
    return f"{with_error(*theirs)}, {sigmas:+.1f} σ"


def with_error(value: float, error: float) -> str:
    """Format a value with its standard error in units of the last digit, as in 0.597(5)."""
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{digits}f}({10**digits * error:.0f})"
