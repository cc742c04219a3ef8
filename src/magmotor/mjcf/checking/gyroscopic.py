"""Bodies that spin so fast that an integrator makes their wobble grow, or damps it.

Linearized about its velocities, a tree of bodies has the accelerations A dv, where A = M^-1 D and D
is MuJoCo's derivative of gyroscopic forces and damping. In one step, an integrator multiplies dv by
1 + R D, where R is how it turns forces into velocities: h M^-1 for Euler's method without damping.
So a wobble, which is an eigenvalue i nu of A, is multiplied by 1 + i nu h, and grows at the rate
nu^2 h/2. Implicit methods damp it at the same rate. Without constraints, the integrator discrete is
implicitfast. See docs/bodies_that_spin.md.
"""

import copy
import math
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.driven_spins import driven_velocities
from magmotor.mjcf.lookup import INTEGRATORS, given_name

EULER, RK4, IMPLICIT, IMPLICITFAST = (
    int(INTEGRATORS[name]) for name in ("Euler", "RK4", "implicit", "implicitfast")
)
NAMES = {int(kind): name for name, kind in INTEGRATORS.items()}
RIGID = {int(mujoco.mjtJoint.mjJNT_FREE): 6, int(mujoco.mjtJoint.mjJNT_BALL): 3}
"""Degrees of freedom of trees that are one rigid body."""

DRIVEN = "can spin"
"""Verb of what actuators, or others that turn, can turn."""

LONG = 10_000
"""Timesteps of interest: growth by e that takes longer is no finding, in any unit of time."""

TUMBLING = 0.1
"""Growth of a body that tumbles, over that of a wobble as fast as its spin departs.

Measured for spins about the middle axis of inertia: 0.095 to 0.14.
"""

EXPLICIT = 0.1
"""Largest difference of R from h M^-1, over that of an implicit method."""

RESOLVED = 0.5
"""Product of the frequency of a wobble and the timestep of RK4 that is proposed."""

TRIES = 10
"""Most timesteps that are tried."""


class Spin(NamedTuple):
    """A spin that does not stay as it is."""

    body: int
    speed: float
    """In rad/s."""
    verb: str
    where: str
    rate: float
    """Of the growth, in 1/s; negative if the wobble decays, but should not."""
    tumbles: bool
    """Whether its angular momentum grows as it tumbles, rather than a wobble."""
    number: int
    """Number of trees of bodies whose spin is not kept in this state."""
    timestep: float
    """The longest one in s, up to the model's, at which none errs; 0 if none is found."""
    of_rk4: float
    """The same for RK4."""
    integrator: str
    """The name of the model's integrator."""


class Tree(NamedTuple):
    """Bodies that move together, linearized."""

    number: int
    velocities: Array
    """Shape (n,)."""
    inertia: Array
    """M, shape (n, n)."""
    matrix: Array
    """A, shape (n, n)."""
    responses: Array
    """R, shape (n, n)."""
    turns: bool
    """Whether it moves, and can turn about all axes."""
    rigid: bool
    driven: bool
    """Whether something keeps it at its velocities in spite of damping."""


def unkept_spin(model: mujoco.MjModel, state: mujoco.MjData) -> Spin | None:
    """Return the spin whose wobble errs most: of the state, of keyframes, or driven."""
    moving = [each for each in _spins(model, state) if each[-1].any()]
    if not moving:
        return None
    probe, step, worst = copy.copy(model), float(model.opt.timestep), None
    long = LONG * step
    probe.opt.enableflags = 0
    probe.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(probe)
    for verb, where, qpos, qvel in moving:
        data.qpos[:], data.qvel[:] = qpos, qvel
        driven = verb == DRIVEN
        trees = [tree for tree in _trees(probe, data, step, driven) if tree.turns]
        grown = [_growth(tree, step, long, int(probe.opt.integrator)) for tree in trees]
        rates = np.array([rate for rate, _ in grown])
        if abs(rates).max(initial=0) <= max(1 / long, abs(worst.rate) if worst else 0.0):
            continue
        fastest = abs(rates).argmax()
        members = probe.body_treeid == trees[fastest].number
        speeds = np.where(members, np.linalg.norm(data.cvel[:, :3], axis=1), 0)
        kinds = int(probe.opt.integrator), RK4
        steps = [_longest_step(probe, data, driven, step, long, kind) for kind in kinds]
        worst = Spin(
            body=int(speeds.argmax()),
            speed=float(speeds.max()),
            verb=verb,
            where=where,
            rate=float(rates[fastest]),
            tumbles=grown[fastest][1],
            number=int((abs(rates) > 1 / long).sum()),
            timestep=steps[0],
            of_rk4=steps[1],
            integrator=NAMES[int(probe.opt.integrator)],
        )
    return worst


def _spins(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[tuple[str, str, Array, Array]]:
    """Yield the states in which something may spin, and words that say which."""
    yield "spins", "", state.qpos, state.qvel
    for k in range(model.nkey):
        name = given_name(model, "key", k) or k
        yield "spins", f" in keyframe {name!r}", model.key_qpos[k], model.key_qvel[k]
    for where, qvel in driven_velocities(model, state):
        yield DRIVEN, where, state.qpos, qvel


def _trees(model: mujoco.MjModel, data: mujoco.MjData, step: float, driven: bool) -> list[Tree]:
    """Return the trees of bodies, linearized; changes the model, but not the state."""
    if not data.qvel.any() or not np.isfinite(data.qvel).all():
        return []
    integrator, qpos, qvel = int(model.opt.integrator), data.qpos.copy(), data.qvel.copy()
    model.opt.timestep, model.opt.integrator = step, IMPLICIT
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_comVel(model, data)
    data.qfrc_smooth[:] = data.qfrc_constraint[:] = 0
    mujoco.mj_implicit(model, data)  # which leaves D
    model.opt.integrator = integrator if integrator in (EULER, RK4, IMPLICIT) else IMPLICITFAST
    first = np.repeat(model.tree_dofadr, model.tree_dofnum)
    inertia, slopes, responses = np.zeros((3, model.nv, int(model.tree_dofnum.max())))
    for row, (start, count) in enumerate(zip(model.D_rowadr, model.D_rownnz, strict=True)):
        own = slice(start, start + count)
        slopes[row, model.D_colind[own] - first[row]] = data.qDeriv[own]
    for column in range(slopes.shape[1]):
        force = (np.arange(model.nv) - first == column).astype(float)
        mujoco.mj_mulM(model, data, product := np.zeros(model.nv), force)
        inertia[:, column] = product
        data.qfrc_smooth[:] = force
        mujoco.mj_solveM(model, data, data.qacc[np.newaxis], force[np.newaxis])
        if integrator != RK4:
            (mujoco.mj_Euler if integrator == EULER else mujoco.mj_implicit)(model, data)
        responses[:, column] = data.qvel - qvel
        data.qpos[:], data.qvel[:] = qpos, qvel
    model.opt.integrator, found = integrator, []
    for number, (start, count) in enumerate(zip(model.tree_dofadr, model.tree_dofnum, strict=True)):
        own = slice(start, start + count)
        mass, slope, response = (part[own, :count] for part in (inertia, slopes, responses))
        moves = qvel[own].any() and np.linalg.matrix_rank(data.cdof[own, :3]) == 3
        rigid = RIGID.get(int(model.jnt_type[model.dof_jntid[start]])) == count
        finite = np.isfinite([mass, slope, response]).all()
        if finite and np.linalg.matrix_rank(mass) == count:  # less if joints move alike
            matrix = np.asarray(np.linalg.solve(mass, slope), float)
            found.append(
                Tree(number, qvel[own], mass, matrix, response, bool(moves), rigid, driven)
            )
    return found


def _growth(tree: Tree, step: float, long: float, integrator: int) -> tuple[float, bool]:
    """Return the rate in 1/s at which the integrator, not the motion itself, lets a wobble grow.

    It is negative where the integrator damps a wobble. The second result is whether it is the rate
    of the angular momentum of a body that tumbles.
    """
    matrix = tree.matrix
    found = np.linalg.eig(matrix)
    speeds, modes = found[0].astype(np.complex128), found[1].astype(np.complex128)
    if integrator == RK4:
        factors = np.polyval(np.array([1 / 24, 1 / 6, 1 / 2, 1, 1]), speeds * step)
    else:
        gains = np.einsum("ij,ij->j", modes.conj(), tree.responses @ tree.inertia @ modes)
        factors = 1 + speeds * gains / (abs(modes) ** 2).sum(axis=0)
    lasts, decay = _lasting(tree, long), np.minimum(speeds.real, 0)
    errors = lasts * (np.log(np.maximum(abs(factors), 1e-300)) / step - speeds.real)
    wobbles = abs(speeds.imag) > abs(speeds.real)
    rates, loss = errors + decay, errors[wobbles].min(initial=0)
    excess = abs(tree.responses @ tree.inertia / step - np.eye(len(matrix))).max()
    if tree.rigid and integrator != RK4 and excess < EXPLICIT * step * abs(matrix).max():
        tumbling = TUMBLING * speeds.real.max() ** 2
        frequencies = np.array([tumbling, _energy_growth(tree)])
        rates = np.append(rates, lasts * step / 2 * frequencies)
    if rates.max() <= -loss:
        return float(loss), False
    return float(rates.max()), bool(rates.argmax() >= len(errors) and speeds.real.max() > 1 / long)


def _lasting(tree: Tree, long: float) -> float:
    """Return the mean square of the velocities until `long`, which damping lowers, over the first.

    Gyroscopic forces do no work.
    """
    if tree.driven:
        return 1.0
    momentum = tree.inertia @ tree.velocities
    exponent = -2 * long * (momentum @ tree.matrix @ tree.velocities) / (momentum @ tree.velocities)
    return float(-np.expm1(-exponent) / exponent) if exponent > 1e-9 else 1.0


def _energy_growth(tree: Tree) -> float:
    """Return the square of a frequency, that of the accelerations A v/2 over the velocities v.

    Both are measured by the kinetic energy of rotation about the center of mass.
    """
    inertia, free, turn = tree.inertia, slice(0, -3), slice(-3, None)
    own = inertia[turn, turn] - inertia[turn, free] @ np.linalg.solve(
        inertia[free, free], inertia[free, turn]
    )
    half, spin = (tree.matrix @ tree.velocities)[turn] / 2, tree.velocities[turn]
    energy = spin @ own @ spin
    if energy <= 0:
        return 0.0
    half = half - spin * (spin @ own @ half) / energy  # damping; gyroscopic forces do no work
    return float(half @ own @ half / energy)


def _longest_step(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    driven: bool,
    step: float,
    long: float,
    integrator: int,
) -> float:
    """Return the longest timestep in s, up to `step`, at which no wobble errs; 0 if none is found.

    With RK4, it also resolves the wobble.
    """
    before, longest, excess = int(model.opt.integrator), step, math.inf
    model.opt.integrator = integrator
    for _ in range(TRIES):
        trees = _trees(model, data, longest, driven)
        trees = [tree for tree in trees if tree.turns or integrator == RK4]
        excess = long * max(abs(_growth(tree, longest, long, integrator)[0]) for tree in trees)
        if integrator == RK4:
            spinning = [np.linalg.eigvals(tree.matrix) for tree in trees if tree.turns]
            product = longest * float(abs(np.concatenate(spinning)).max())
            excess = product / RESOLVED if product > RESOLVED else excess**0.2  # it is as h^5
        if excess <= 1:
            break
        longest = 0.999 * longest / min(excess, 1e3)
    model.opt.integrator = before
    return longest if excess <= 1 and math.isfinite(excess) else 0.0
