"""Bias of the positions of trees at a temperature: `Langevin` against the Metropolis algorithm."""

import zlib
from collections.abc import Mapping
from functools import partial

import mujoco
import numpy as np
import xarray as xr
from scipy.linalg import eigh
from scipy.optimize import minimize

import magmotor as mm
from benchmarks.accuracy.tree_models import TREES, Tree
from benchmarks.harness.records import Case, Record
from benchmarks.harness.tables import table
from magmotor.common.arrays import Array
from magmotor.mjcf.boltzmann.potential import potential_energy
from magmotor.mjcf.langevin.samples import LangevinDiverged
from magmotor.numerics.batch_means import mean_and_error

REPLICAS = 32
RUNS = (("baoab", 1.0), ("baoab", 0.5), ("obabo", 1.0))
"""Splittings, and timesteps in units of 1/omega."""

HOTTER = 3.0
"""Ratio of a second temperature to that of each tree."""

SAMPLES, STEPS = 1000, 15_000
"""Records of each chain of the Metropolis algorithm, and steps of 1/omega of each replica."""

SLOW = {"two magnetic trees": 8}
"""Factors by which the chains are shorter."""

LONGER = {"double pendulum, weak friction": 6, "six links, weak friction": 6}
"""Factors by which the runs are longer."""


class Law:
    """The potential energy of a tree about its rest position, its frequencies and observables."""

    def __init__(self, tree: Tree):
        self.tree, self.model = tree, tree.model()
        for flag in tree.disable:
            bit = int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}"))
            self.model.opt.disableflags |= bit
        self._data, self._energy = mujoco.MjData(self.model), potential_energy(self.model)
        self.rest = self.model.qpos0.copy()
        start = np.zeros(self.model.nv)
        found = minimize(lambda move: self.energy(self.moved(move)) / tree.kT, start, tol=1e-10)
        self.rest = self.moved(found.x)
        self.lowest = self.energy(self.rest)

    def moved(self, change: Array) -> Array:
        """Return the position at a displacement (nv,) from rest."""
        position = self.rest.copy()
        mujoco.mj_integratePos(self.model, position, change, 1.0)
        return position

    def energy(self, position: Array) -> float:
        """Return the potential energy in J."""
        self._data.qpos[:] = position
        mujoco.mj_fwdPosition(self.model, self._data)
        return self._energy(self._data)

    def frequencies(self) -> Array:
        """Return the angular frequencies of small oscillations in rad/s, shape (nv,)."""
        units, n, step = np.eye(self.model.nv), self.model.nv, 1e-3
        stiffness, inertia = np.empty((2, n, n))
        for i in range(n):
            for j in range(n):
                stiffness[i, j] = (
                    sum(
                        a * b * self.energy(self.moved(step * (a * units[i] + b * units[j])))
                        for a in (1, -1)
                        for b in (1, -1)
                    )
                    / (2 * step) ** 2
                )
        self.energy(self.rest)
        for row, unit in zip(inertia, units, strict=True):
            mujoco.mj_mulM(self.model, self._data, row, unit)
        return np.sqrt(np.maximum(eigh(stiffness, inertia, eigvals_only=True), 0.0))

    def turn(self, timestep: float) -> float:
        """Return the largest thermal velocity at rest times the timestep, in rad or m."""
        self.energy(self.rest)
        inverse = np.empty((self.model.nv, self.model.nv))
        mujoco.mj_solveM(self.model, self._data, inverse, np.eye(self.model.nv))
        return timestep * float(np.sqrt(self.tree.kT * inverse.diagonal().max()))

    def observables(self, positions: Array) -> dict[str, Array]:
        """Return 1 - cos of each angle from rest or squares of lengths, and the energy over kT."""
        model, found = self.model, {}
        for i in range(model.njnt):
            name, kind, start = model.joint(i).name, model.jnt_type[i], model.jnt_qposadr[i]
            move = positions[..., start] - self.rest[start]
            if kind == mujoco.mjtJoint.mjJNT_HINGE:
                found[name] = 1 - np.cos(move)
            elif kind == mujoco.mjtJoint.mjJNT_SLIDE:
                found[name] = move**2
            else:
                if kind == mujoco.mjtJoint.mjJNT_FREE:
                    place = slice(start, start + 3)
                    moves = positions[..., place] - self.rest[place]
                    found[f"{name}: place"] = (moves**2).sum(axis=-1)
                    start += 3
                turn = positions[..., start : start + 4] @ self.rest[start : start + 4]
                found[name] = 2 - 2 * turn**2
        energies = np.apply_along_axis(self.energy, -1, positions)
        found["V/kT"] = (energies - self.lowest) / self.tree.kT
        return found


def by_quadrature(law: Law, points: int = 160) -> dict[str, float]:
    """Return the means of all observables of a tree of one or two hinges and slides."""
    model, data = law.model, mujoco.MjData(law.model)
    slides = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
    deviations = np.sqrt(law.tree.kT / np.maximum(model.jnt_stiffness, 1e-9))
    widths = np.where(slides, 8 * deviations, np.pi)
    axis = (np.arange(points) + 0.5) * 2 / points - 1
    grid = np.stack(np.meshgrid(*[axis] * model.nv, indexing="ij"), axis=-1)
    positions = law.rest + grid.reshape(-1, model.nv) * widths
    volumes, inertia = np.empty(len(positions)), np.empty((model.nv, model.nv))
    for k, data.qpos[:] in enumerate(positions):
        mujoco.mj_fwdPosition(model, data)
        for row, unit in zip(inertia, np.eye(model.nv), strict=True):
            mujoco.mj_mulM(model, data, row, unit)
        volumes[k] = np.sqrt(np.linalg.det(inertia))
    found = law.observables(positions)
    weights = volumes * np.exp(-found["V/kT"])
    return {name: float(values @ weights / weights.sum()) for name, values in found.items()}


def truth(law: Law, samples: int, every: int = 10) -> dict[str, tuple[float, float]]:
    """Return means and standard errors of all observables, by the Metropolis algorithm."""
    run = mm.metropolis(
        law.model, law.tree.kT, samples=samples, replicas=REPLICAS, record_interval=every,
        burn_in=300, initial=law.rest, seed=1,
    )  # fmt: skip
    found = law.observables(run.qpos.values)
    return {name: mean_and_error(series) for name, series in found.items()}


def sampled(
    law: Law, size: float, nstep: int, *, record_interval: int = 4, splitting: str = "baoab"
) -> xr.Dataset:
    """Return a run of all replicas at the timestep size/omega, with noise of its own."""
    tree = law.tree
    model = tree.model(size / (tree.frequency or law.frequencies()[-1]))
    start = mujoco.MjData(model)
    start.qpos[:] = law.rest
    seed = zlib.crc32(f"{model.nv} {tree.kT} {size} {splitting}".encode())
    thermostat = mm.Langevin(
        model, tree.kT, friction=tree.friction, disable=tree.disable, splitting=splitting, seed=seed
    )
    return thermostat.sample(
        nstep * thermostat.timestep,
        replicas=REPLICAS,
        record_interval=record_interval,
        burn_in=max(1000, nstep // 5) * thermostat.timestep,
        initial=start,
    )


def cases(quick: bool) -> list[Case]:
    """Return a case for each tree at two temperatures."""
    names = ["double pendulum"] if quick else TREES
    return [
        Case(
            f"tree/{name}/{ratio:g}", partial(_measure, name, ratio, quick), 2.0 if quick else 90.0
        )
        for name in names
        for ratio in (1.0, HOTTER)
    ]


def _measure(name: str, ratio: float, quick: bool) -> Record:
    tree = TREES[name]
    law = Law(tree._replace(kT=ratio * tree.kT))
    shorter = 20 if quick else 1
    steps = STEPS * LONGER.get(name, 1) // shorter
    if law.model.nv <= 2:
        exact = {key: (mean, 0.0) for key, mean in by_quadrature(law).items()}
    else:
        exact = truth(law, SAMPLES // SLOW.get(name, 1) // shorter)
    return {
        "tree": name,
        "kT": law.tree.kT,
        "runs": [_biases(law, exact, *run, steps) for run in RUNS],
    }


def _biases(
    law: Law, exact: Mapping[str, tuple[float, float]], splitting: str, size: float, steps: int
) -> Record:
    """Return the relative biases of all observables with their standard errors."""
    try:
        run = sampled(
            law, size, int(steps / size), record_interval=round(4 / size), splitting=splitting
        )
    except LangevinDiverged as error:
        return {"splitting": splitting, "size": size, "failed": str(error)}
    kinetic = mm.kinetic_temperature(law.model, run)
    found = {}
    for name, series in law.observables(run.qpos.values).items():
        mean, error = mean_and_error(series)
        truth, truth_error = exact[name]
        found[name] = mean / truth - 1, float(np.hypot(error, truth_error) / truth)
    return {
        "splitting": splitting,
        "size": size,
        "turn": law.turn(run.attrs["timestep"]),
        "biases": found,
        "kinetic": [float(each) / law.tree.kT for each in (kinetic.total, kinetic.total_error)],
    }


def tables(records: Mapping[str, Record]) -> dict[str, str]:
    """Return the table of all trees."""
    rows = [
        [record["tree"], f"{record['kT']:.2g}", f"`{run['splitting']}`", f"{run['size']:g}",
         *_cells(run)]
        for record in records.values()
        if "tree" in record
        for run in record["runs"]
    ]  # fmt: skip
    columns = ["", "kT (J)", "splitting", "ωh", "turn a step", "energy", "worst", "kinetic T/kT"]
    return {"trees": table(columns, rows)}


def _cells(run: Record) -> list[str]:
    if "failed" in run:
        return ["", "lost", "", ""]
    biases = dict(run["biases"])
    energy = biases.pop("V/kT")
    name, worst = max(biases.items(), key=lambda item: abs(item[1][0]) / item[1][1])
    kinetic, error = run["kinetic"]
    return [
        f"{run['turn']:.2f}",
        _percent(*energy),
        f"{name}: {_percent(*worst)}",
        f"{kinetic:.3f} ± {error:.3f}",
    ]


def _percent(bias: float, error: float) -> str:
    return f"{100 * bias:+.1f} ± {100 * error:.1f} %"
