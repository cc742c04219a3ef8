"""Errors of promises, found by plain steps of MuJoCo, with nothing of `mm.advise`."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import mujoco
import numpy as np

import magmotor as mm

TENTH = 10
"""Steps of a reference within a step of what is judged."""

HALVINGS, SECONDS = 5, 30.0
"""Largest number of times that another integrator halves its step, and the time for that."""

PROVEN = 0.25
"""Doubt of another integrator's reference, over the promise, with which it can judge."""

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
OTHERS = "RK4", "implicitfast", "Euler"

Observe = Callable[[mujoco.MjModel, mujoco.MjData], np.ndarray]


@dataclass(frozen=True)
class Quantity:
    """What a promise refers to."""

    observe: Observe
    """Numbers of a state, in data that may be changed."""
    energies: bool = False
    """Whether they are the total and the kinetic energy; the scale is the range of the total or
    the largest kinetic energy."""

    def distance(self, own: np.ndarray, truth: np.ndarray) -> float:
        """Largest distance of two paths over the range of the second one; NaN without a truth."""
        if not np.isfinite(truth).all():
            return np.nan
        if not np.isfinite(own).all():
            return np.inf
        apart, ranges = own - truth, np.ptp(truth, axis=0)
        if self.energies:
            return float(np.abs(apart[:, 0]).max() / max(ranges[0], truth[:, 1].max()))
        return float(np.linalg.norm(apart, axis=1).max() / np.linalg.norm(ranges))


@dataclass
class Judgment:
    """What plain steps find."""

    own: float
    """Error against the same integrator at a tenth of the step."""
    other: float = np.nan
    """Error against another integrator; NaN if none proves itself."""
    doubt: float = np.nan
    """How far that one's finest two paths are apart."""
    by: str = ""
    """The other integrator."""

    def holds(self, promised: float) -> bool:
        """Whether the promise holds by both judges, as far as the other one is certain."""
        return self.own <= promised and not self.other - self.doubt > promised


def judge(
    model: mujoco.MjModel, data: mujoco.MjData, quantity: Quantity, integrator: str, step: float,
    horizon: float, promised: float,
) -> Judgment:  # fmt: skip
    """Judge an integrator with a timestep, both in s, up to a horizon."""
    count = int(horizon / step + 1e-9)

    def path(integrator: str, parts: int) -> np.ndarray:
        return along(model, data, quantity.observe, integrator, step / parts, parts, count)

    own = path(integrator, 1)
    found = Judgment(quantity.distance(own, path(integrator, TENTH)))
    end = time.perf_counter() + SECONDS
    for other in OTHERS:
        if other == integrator:
            continue
        for truth, doubt in references(partial(path, other), quantity, end):
            if doubt <= PROVEN * promised:
                return Judgment(found.own, quantity.distance(own, truth), doubt, other)
    return found


def references(
    path: Callable[[int], np.ndarray], quantity: Quantity, end: float
) -> Iterator[tuple[np.ndarray, float]]:
    """Yield ever finer paths, and how far each is from the one before.

    Of two ends of a halving, also the straight line to step 0 through them counts as a path.
    """
    before = None
    for halving in range(HALVINGS + 1):
        if time.perf_counter() > end:
            return
        fine = path(TENTH * 2**halving)
        if before is None:
            before = fine, None
            continue
        coarse, line = before
        yield fine, quantity.distance(coarse, fine)
        straight = 2 * fine - coarse
        if line is not None:
            yield straight, quantity.distance(line, straight)
        before = fine, straight


def along(
    model: mujoco.MjModel, data: mujoco.MjData, observe: Observe, integrator: str, step: float,
    every: int, count: int,
) -> np.ndarray:  # fmt: skip
    """Numbers after every so many steps, shape (count + 1, n); NaN when they are not finite."""
    model.opt.timestep = step
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    run, seen = mujoco.MjData(model), mujoco.MjData(model)
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    mujoco.mj_setState(model, run, state, STATE)
    rows = []
    for k in range(count + 1):
        if k:
            mujoco.mj_step(model, run, nstep=every)
        mujoco.mj_getState(model, run, state, STATE)
        mujoco.mj_setState(model, seen, state, STATE)
        rows.append(observe(model, seen))
    return np.array(rows)


def quantity_of(model: mujoco.MjModel, name: str) -> Quantity:
    """What `mm.advise` calls "positions", "energy", "body NAME" or "site NAME"."""
    kind, _, element = name.partition(" ")
    if kind == "positions":
        return Quantity(matter(model))
    if kind == "energy":
        return Quantity(energies, energies=True)

    def place(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
        mujoco.mj_kinematics(model, data)
        if kind == "body":
            return data.xipos[model.body(element).id].copy()
        return data.site_xpos[model.site(element).id].copy()

    return Quantity(place)


def matter(model: mujoco.MjModel) -> Observe:
    """Four points of equal mass of each body that moves.

    They have the body's mass and inertia: the vertices of a tetrahedron in its principal frame.
    """
    vertices = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    mass = model.body_mass[:, None]
    half = model.body_inertia.sum(axis=1, keepdims=True) / 2 - model.body_inertia
    radii = np.sqrt(np.maximum(half, 0) / np.maximum(mass, 1e-300))
    moving = movable(model)
    weight = np.sqrt(mass / mass[moving].sum() / 4)

    def points(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
        mujoco.mj_kinematics(model, data)
        frames = data.ximat.reshape(-1, 3, 3)
        corners = np.einsum("bij,vj->bvi", frames * radii[:, None, :], vertices)
        places = (data.xipos[:, None, :] + corners) * weight[:, None]
        return places[moving].ravel()

    return points


def movable(model: mujoco.MjModel) -> np.ndarray:
    """Whether each body moves, also with an ancestor, shape (nbody,)."""
    moving = np.zeros(model.nbody, bool)
    for body in range(1, model.nbody):
        moving[body] = moving[model.body_parentid[body]] or model.body_dofnum[body] > 0
    return moving


def energies(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Total and kinetic energy in J."""
    mujoco.mj_forward(model, data)
    mujoco.mj_energyPos(model, data)
    mujoco.mj_energyVel(model, data)
    potential, kinetic = data.energy
    magnetic = mm.magnetic_energy(model, data) if model.nuser_site > 0 else 0.0
    return np.array([potential + magnetic + kinetic, kinetic])
