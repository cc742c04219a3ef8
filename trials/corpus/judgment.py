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

FEW = 500
"""Number of steps below which the range of a motion is looked for between them, too."""

HALVINGS, SECONDS = 5, 30.0
"""Largest number of times that another integrator halves its step, and the time for that."""

PROVEN = 0.25
"""Doubt of another integrator's reference, over the promise, with which it can judge."""

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
OTHERS = "RK4", "implicitfast", "Euler"

Observe = Callable[[mujoco.MjModel, mujoco.MjData], np.ndarray]


STILL = 1e-3
"""Elements that move by less than this part of what moves most do not count."""

Part = tuple[slice, float]
"""Numbers of one element, and the unit of its motion."""


@dataclass(frozen=True)
class Quantity:
    """What a promise refers to."""

    observe: Observe
    """Numbers of a state, in data that may be changed."""
    energies: bool = False
    """Whether they are the total and the kinetic energy; the scale is the range of the total or
    the largest kinetic energy."""
    size: int | None = None
    """How many numbers count as a whole; further ones belong to elements only."""
    parts: tuple[Part, ...] = ()
    """Elements that count over their own ranges, too."""

    def distance(self, own: np.ndarray, truth: np.ndarray, whole: np.ndarray) -> float:
        """Largest distance of two paths over ranges of the whole motion; NaN without a truth."""
        if not np.isfinite(truth).all():
            return np.nan
        if not np.isfinite(own).all():
            return np.inf
        apart, ranges = own - truth, np.ptp(whole, axis=0)
        if self.energies:
            return float(np.abs(apart[:, 0]).max() / max(ranges[0], whole[:, 1].max()))
        sizes = [float(np.linalg.norm(ranges[part])) for part, _ in self.parts]
        moved = [size / unit for size, (_, unit) in zip(sizes, self.parts, strict=True)]
        judged = [(slice(self.size), float(np.linalg.norm(ranges[: self.size])))]
        for size, move, (part, _) in zip(sizes, moved, self.parts, strict=True):
            if move > STILL * max(moved):
                judged.append((part, size))
        return max(
            float(np.linalg.norm(apart[:, part], axis=1).max()) / size for part, size in judged
        )


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
    # A few long steps may miss the ends of a motion.
    every, fine = (1 if count < FEW else TENTH), step / TENTH
    records = int(horizon / fine / every + 1e-9)
    whole = along(model, data, quantity.observe, integrator, fine, every, records)
    distance = partial(quantity.distance, whole=whole)
    found = Judgment(distance(own, whole[:: TENTH // every][: count + 1]))
    end = time.perf_counter() + SECONDS
    for other in OTHERS:
        if other == integrator:
            continue
        for truth, doubt in references(partial(path, other), distance, end):
            if doubt <= PROVEN * promised:
                return Judgment(found.own, distance(own, truth), doubt, other)
    return found


def references(
    path: Callable[[int], np.ndarray], distance: Callable[[np.ndarray, np.ndarray], float],
    end: float,
) -> Iterator[tuple[np.ndarray, float]]:  # fmt: skip
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
        yield fine, distance(coarse, fine)
        straight = 2 * fine - coarse
        if line is not None:
            yield straight, distance(line, straight)
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


def quantity_of(model: mujoco.MjModel, name: str, *, whole: bool = True) -> Quantity:
    """What `mm.advise` calls "positions", "energy", "body NAME" or "site NAME".

    Unless only the `whole` counts, each element does, too.
    """
    kind, _, element = name.partition(" ")
    if kind == "positions":
        return Quantity(matter(model)) if whole else with_joints(model)
    if kind == "energy":
        return Quantity(energies, energies=True)

    def place(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
        mujoco.mj_kinematics(model, data)
        if kind == "body":
            return data.xipos[model.body(element).id].copy()
        return data.site_xpos[model.site(element).id].copy()

    if whole:
        return Quantity(place)
    return Quantity(place, parts=tuple((slice(k, k + 1), 1.0) for k in range(3)))


def with_joints(model: mujoco.MjModel) -> Quantity:
    """All matter, and as elements the positions of joints, and axes of those that turn freely."""
    points, size = matter(model), 12 * int(movable(model).sum())
    length = model.stat.meansize
    units, turning = [], []
    for kind, first in zip(model.jnt_type.tolist(), model.jnt_qposadr.tolist(), strict=True):
        hinge, slide, free = 3, 2, 0
        turning += [first + 3 * (kind == free)] * (kind not in (hinge, slide))
        lengths = {hinge: [(first, 1.0)], slide: [(first, length)]}
        lengths[free] = [(first + k, length) for k in range(3)]
        units += lengths.get(kind, [])

    def observe(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
        frames = []
        for first in turning:
            w, *v = data.qpos[first : first + 4] / np.linalg.norm(data.qpos[first : first + 4])
            cross = np.cross(np.eye(3), v)
            frames.append((np.eye(3) - 2 * w * cross + 2 * cross @ cross).ravel())
        plain = data.qpos[[place for place, _ in units]]
        return np.concatenate([points(model, data), plain, *frames])

    ends = size + len(units)
    parts = [(slice(size + k, size + k + 1), unit) for k, (_, unit) in enumerate(units)]
    parts += [(slice(ends + 3 * k, ends + 3 * k + 3), 1.0) for k in range(3 * len(turning))]
    return Quantity(observe, size=size, parts=tuple(parts))


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
