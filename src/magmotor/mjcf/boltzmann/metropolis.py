"""The Metropolis algorithm: samples of the exact law of a model's positions.

It shares nothing with the integrators but MuJoCo's kinematics and mass matrix.
"""

import math
from collections.abc import Iterator
from typing import Annotated, NamedTuple

import mujoco
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from tqdm import tqdm

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_array
from magmotor.common.environment import physical_memory
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Count, Positive, Seed, integer
from magmotor.mjcf.boltzmann.potential import Energy, potential_energy
from magmotor.mjcf.declared import name_of

TARGET = 0.35
"""Fraction of the proposals that the steps are adapted to accept."""

FIRST_STEP = 0.1
"""Step in rad and m before the adaptation."""

FREE, SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)


@checked
def metropolis(  # noqa: PLR0913 (options)
    model: mujoco.MjModel,
    kT: Positive,
    *,
    samples: Count = 1000,
    replicas: Count = 16,
    seed: Seed = 0,
    record_interval: Count = 10,
    burn_in: Annotated[int, integer(at_least=0)] = 1000,
    potential: Energy | None = None,
    initial: ArrayLike | None = None,
) -> xr.Dataset:
    """Draw positions of a model from Boltzmann's law by the Metropolis algorithm.

    The density of the positions q at temperature kT is sqrt(det M(q)) exp(-V(q)/kT), where M is the
    mass matrix, which contains the armature, and V the potential energy. It is a density with
    respect to lengths and angles for slide and hinge joints, and to the uniform (Haar) measure for
    the rotations of ball and free joints. The root of the determinant remains when the velocities
    are integrated out; friction has no influence.

    A sweep proposes to move each joint on its own, then all at once, by Gaussian steps. The steps
    are adapted during the burn-in to accept about 35 % of the proposals, then frozen.

    Parameters
    ----------
    model : mujoco.MjModel
        Controls and activations are zero.
    kT : float
        Temperature in J.
    samples : int
        Number of recorded positions for each replica.
    replicas : int
        Number of independent chains.
    seed : int
    record_interval : int
        Number of sweeps from one record to the next.
    burn_in : int
        Number of sweeps before the first record.
    potential : callable, optional
        A function of an `mjData` that returns the potential energy in J, and replaces the model's.
        Positions, orientations, lengths of tendons and the mass matrix are up to date; it must not
        change the data. Infinite energy excludes a position. By default, V consists of gravity and
        its compensation, the springs and soft limits of joints and tendons, actuators without
        control, and the dipoles and the potentials of joints that act inside `magnetism`.
    initial : array_like, shape (nq,) or (replicas, nq), optional
        First positions of the chains; by default `qpos0`.

    Returns
    -------
    xarray.Dataset
        `qpos` (replica, sample, nq), `potential_energy` (replica, sample) in J, and `acceptance`
        (replica, move): the accepted fraction of the proposals after the burn-in.

    Raises
    ------
    ValueError
        kT is not positive; the energy is not finite at the first position; the result does not fit
        in memory; or an equality, a contact, an actuator, a flex or a plugin has a potential that
        is not known here. The message names it.

    Notes
    -----
    A coordinate that no potential confines, like the position of a free body without gravity, has
    no law that could be sampled: it diffuses, as it does in a simulation. A free body that falls
    without a floor falls in the chains, too.

    A proposal takes MuJoCo's positions of the whole model: 10 µs for two or twenty links, 30 µs for
    robosuite's Panda (7 joints, 58 geoms), 50 µs for dm_control's humanoid, 190 µs for a Shadow
    hand (24 joints, 62 geoms), and 70 µs or more with dipoles. The number of sweeps after which a
    chain forgets grows with the number of joints; compare the replicas.

    The algorithm is that of N. Metropolis et al., J. Chem. Phys. 21, 1087 (1953). The root of the
    determinant is explained by M. Fixman, Proc. Natl. Acad. Sci. USA 71, 3050 (1974).

    Examples
    --------
    >>> import mujoco
    >>> import numpy as np
    >>> import magmotor as mm
    >>> model = mujoco.MjModel.from_xml_string('''
    ... <mujoco><worldbody><body>
    ...   <joint axis="0 1 0"/><inertial pos="0 0 -1" mass="1" diaginertia="1 1 1"/>
    ... </body></worldbody></mujoco>''')
    >>> run = mm.metropolis(model, kT=9.81, seed=1)
    >>> round(float(np.cos(run.qpos).mean()), 2)  # I_1(1)/I_0(1) = 0.446
    0.45
    """
    if 8 * replicas * samples * (model.nq + 1) > physical_memory():
        raise ArgumentError(
            "samples", samples, f"{replicas} x {samples} records do not fit in memory"
        )
    walker = _Walker(model, kT, potential)
    starts = _starts(model, initial, replicas)
    progress = tqdm(
        total=replicas * (burn_in + samples * record_interval), desc="metropolis", unit="sweep",
        delay=2, disable=None,
    )  # fmt: skip
    chains = []
    for replica, start in enumerate(starts):
        random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(replica,)))
        chains.append(walker.chain(start, random, samples, record_interval, burn_in, progress))
    progress.close()
    positions, energies, acceptance = (np.stack(each) for each in zip(*chains, strict=True))
    return xr.Dataset(
        {
            "qpos": (("replica", "sample", "nq"), positions, {"long_name": "positions"}),
            "potential_energy": (
                ("replica", "sample"), energies, {"units": "J", "long_name": "potential energy"},
            ),
            "acceptance": (
                ("replica", "move"), acceptance, {"units": "1", "long_name": "accepted fraction"},
            ),
        },
        {"replica": np.arange(replicas), "move": [*walker.names]},
        {"kT": kT, "seed": seed, "record_interval": record_interval, "burn_in": burn_in},
    )  # fmt: skip


def _starts(model: mujoco.MjModel, initial: ArrayLike | None, replicas: int) -> Array:
    """Return the first positions, shape (replicas, nq), with quaternions of length 1."""
    given = check_array("initial", model.qpos0 if initial is None else initial, ..., model.nq)
    if given.ndim > 1 and given.shape != (replicas, model.nq):
        raise ArgumentError("shape of initial", given.shape, f"must be {(replicas, model.nq)}")
    starts = np.array(np.broadcast_to(given, (replicas, model.nq)), order="C")
    for start in starts:
        mujoco.mj_normalizeQuat(model, start)
    return starts


class _State(NamedTuple):
    """A position, its potential energy, and the logarithm of its density."""

    position: Array
    energy: float
    density: float


class _Walker:
    """The chains of one model: its law, and the moves of a sweep."""

    def __init__(self, model: mujoco.MjModel, kT: float, potential: Energy | None):
        if not model.nv:
            raise ArgumentError("number of joints", model.njnt, "must be at least 1")
        self.model = positions_only(model)
        self.data = mujoco.MjData(self.model)
        self.kT = kT
        self.energy = potential_energy(model) if potential is None else _checked(potential)
        blocks = [*_blocks(model)]
        if len(blocks) > 1:
            blocks.append(_Block("all", np.ones(model.nv, bool), np.inf))
        names, moves, largest = zip(*blocks, strict=True)
        self.names, self.moves, self.largest = names, np.array(moves), np.array(largest)

    def chain(
        self,
        start: Array,
        random: np.random.Generator,
        samples: int,
        record_interval: int,
        burn_in: int,
        progress: tqdm,
    ) -> tuple[Array, Array, Array]:
        """Return positions, energies, and the accepted fractions of the moves."""
        state = self.at(start)
        if not np.isfinite(state.density):
            raise ArgumentError(
                "initial", start.tolist(), "the potential energy must be finite there"
            )
        steps = np.full(len(self.moves), FIRST_STEP)
        steps[-1] = 1.0 if len(steps) > 1 else FIRST_STEP
        for k in range(burn_in):
            state, accepted = self.sweep(state, self.widths(steps), random)
            steps *= np.exp((accepted - TARGET) / (k + 1) ** 0.6)
            steps = np.minimum(steps, self.largest)
            progress.update()
        widths, counts = self.widths(steps), np.zeros(len(steps))
        positions, energies = np.empty((samples, self.model.nq)), np.empty(samples)
        for i in range(samples):
            for _ in range(record_interval):
                state, accepted = self.sweep(state, widths, random)
                counts += accepted
            positions[i], energies[i] = state.position, state.energy
            progress.update(record_interval)
        return positions, energies, counts / (samples * record_interval)

    def widths(self, steps: Array) -> Array:
        """Return the standard deviations of all moves, shape (moves, nv).

        The last step is a factor of the others if it belongs to the move of all joints.
        """
        if len(steps) == 1:
            return steps[:, np.newaxis] * self.moves
        single = steps[:-1, np.newaxis] * self.moves[:-1]
        return np.vstack([single, steps[-1] * single.sum(axis=0)])

    def sweep(
        self, state: _State, widths: Array, random: np.random.Generator
    ) -> tuple[_State, NDArray[np.bool_]]:
        """Propose each move once; return the last state and which moves were accepted."""
        changes = widths * random.standard_normal(widths.shape)
        thresholds = (-random.standard_exponential(len(widths))).tolist()
        accepted = np.zeros(len(widths), bool)
        for k, threshold in enumerate(thresholds):
            position = state.position.copy()
            mujoco.mj_integratePos(self.model, position, changes[k], 1.0)
            proposed = self.at(position)
            if proposed.density - state.density > threshold:
                state, accepted[k] = proposed, True
        return state, accepted

    def at(self, position: Array) -> _State:
        """Return the state at a position."""
        self.data.qpos[:] = position
        mujoco.mj_fwdPosition(self.model, self.data)
        energy = self.energy(self.data)
        # M = L^T D L, and MuJoCo keeps 1/D.
        volume = -0.5 * float(np.add.reduce(np.log(self.data.qLDiagInv)))
        return _State(position, energy, volume - energy / self.kT)


def _checked(potential: Energy) -> Energy:
    """Return a function that calls the user's one, and checks its result."""

    def energy(data: mujoco.MjData) -> float:
        value = potential(data)
        try:
            number = math.nan if isinstance(value, str | bytes) else float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if math.isnan(number):
            sentence = "must be a number, which may be infinite where no position is allowed"
            raise ArgumentError("potential(data)", value, sentence)
        return number

    return energy


def positions_only(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy of a model in which no constraint acts and no body sleeps."""
    copy = mujoco.MjModel.__copy__(model)
    copy.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    copy.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    copy.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    return copy


def joint_names(model: mujoco.MjModel) -> list[str]:
    """Return the names of all joints; that of an unnamed one contains its number."""
    return [name_of(model, "joint", k) for k in range(model.njnt)]


def is_translation(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Whether each velocity is a length over time, and not an angle, shape (nv,)."""
    kinds = model.jnt_type[model.dof_jntid]
    first = model.jnt_dofadr[model.dof_jntid]
    return (kinds == SLIDE) | ((kinds == FREE) & (np.arange(model.nv) < first + 3))


class _Block(NamedTuple):
    """Velocities of one joint and one unit, which are moved on their own."""

    name: str
    moved: NDArray[np.bool_]
    """Which velocities these are, shape (nv,)."""
    largest_step: float


def _blocks(model: mujoco.MjModel) -> Iterator[_Block]:
    """Yield the blocks of all joints; a free joint has two."""
    translates = is_translation(model)
    for joint, name in enumerate(joint_names(model)):
        own = model.dof_jntid == joint
        free = model.jnt_type[joint] == FREE
        if (own & translates).any():
            yield _Block(f"{name}: position" if free else name, own & translates, np.inf)
        if (own & ~translates).any():
            yield _Block(f"{name}: rotation" if free else name, own & ~translates, np.pi)
