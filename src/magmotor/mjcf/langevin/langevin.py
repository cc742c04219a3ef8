"""Langevin dynamics of any MuJoCo model by splitting; see `Langevin`."""

import copy
import ctypes
import os
import threading
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from tqdm import tqdm

import magmotor_plugin
from magmotor.common.arrays import Array
from magmotor.common.checks import check_choice, check_floats, check_integer, check_type, reject
from magmotor.common.environment import physical_memory
from magmotor.mjcf import hooks, layout
from magmotor.mjcf.forces.dipole_wrenches import stack_bytes
from magmotor.mjcf.langevin.baths import dampers_with_temperatures, read_friction, read_kT
from magmotor.mjcf.langevin.friction import ON_JOINTS, Friction, model_friction
from magmotor.mjcf.langevin.splitting_loop import FROM_TIME, compiled
from magmotor.mjcf.langevin.supported import check_tree
from magmotor.mjcf.langevin.tree import Room, read_tree, room_for
from magmotor.mjcf.lookup import disabled
from magmotor.noise import LARGEST_STEP, BrownianPath
from magmotor.numerics.splittings import LANGEVIN, Scheme, kicks_that_evaluate

FIRST_STEPS = 64
"""Number of steps taken before their duration is known."""

SECONDS_BETWEEN_CHECKS = 0.1
"""Approximate time between two checks for Ctrl-C."""

CODES = "ABOKRS"
"""Parts of schemes, in the order of their codes in the compiled loop."""


class Langevin:
    """Langevin dynamics of a MuJoCo model: its motion at a temperature.

    Friction and noise drive the positions and velocities to Boltzmann's law, whose density is
    proportional to sqrt(det M(q)) exp(-V(q)/kT) exp(-v^T M(q) v/(2 kT)), where M is the inertia
    and V the potential energy. The factor sqrt(det M) belongs to a tree of joints.

    A step is split into B, kicks by all forces of the position; A, the motion without forces; and
    O, friction and noise, whose temperature is exact for any timestep.

    Parameters
    ----------
    model : mujoco.MjModel
        Read once; do not change it afterwards. Any tree of joints. Limits, equalities and
        frictionless contacts act as the springs and dampers that MuJoCo's soft constraints are at
        rest. The options of the integrator and of the solver have no effect.
    kT : float or mapping of str to float
        Temperature in J; or temperatures of the dampers of the named joints, tendons and bodies (a
        body stands for its joints and for its drag in a fluid), each of which is a bath.
    splitting : {"baoab", "obabo", "middle", "verlet", "o-rk4-o", "o-step-o"}
        The last one consists of steps of MuJoCo itself between friction and noise. It supports
        every model, but has the temperature only approximately: constraints, dry friction and
        errors of MuJoCo's integrator change it.
    friction : float or array_like, shape (nv,) or (nv, nv), optional
        Instead of the model's own friction: the rate of the friction (rate M) in 1/s, or the
        damping of each degree of freedom, or a symmetric matrix. By default the friction is what
        the model says: damping of joints, tendons and actuators, and drag in a viscous fluid.
    disable : sequence of str
        Flags of MuJoCo that are disabled in a copy of the model, such as "contact",
        "frictionloss", "limit", "equality" and "actuation".
    seed : int
        Selects the noise, with the number of the replica and of the step.
    path : BrownianPath, optional
        Brownian path to follow, instead of a seed.

    Raises
    ------
    ValueError
        A number is invalid, nothing is damped, or something that acts on the model has no law of
        fluctuation and dissipation. The message names the element and what to do.
    LayoutError
        This version of MuJoCo lays out its structs differently than it declares.

    Notes
    -----
    B uses the forces at zero velocity; A is the explicit midpoint rule at conserved kinetic energy,
    in as many pieces as its accuracy requires; O is the Crank-Nicolson rule. BAOAB is due to
    Leimkuhler and Matthews, J. Chem. Phys. 138, 174102 (2013).

    Examples
    --------
    >>> import magmotor as mm
    >>> import mujoco
    >>> model = mujoco.MjModel.from_xml_string('''
    ... <mujoco>
    ...   <worldbody>
    ...     <body>
    ...       <joint name="hinge" type="hinge" axis="0 1 0" damping="0.1"/>
    ...       <geom type="capsule" fromto="0 0 0 0 0 -1" size="0.05" mass="1"/>
    ...     </body>
    ...   </worldbody>
    ... </mujoco>
    ... ''')
    >>> run = mm.Langevin(model, kT=0.5).sample(10_000, replicas=4, every=10)
    >>> run.qpos.shape
    (4, 1000, 1)
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        kT: float | Mapping[str, float],
        *,
        splitting: str = "baoab",
        friction: float | ArrayLike | None = None,
        disable: Sequence[str] = (),
        seed: int = 0,
        path: BrownianPath | None = None,
    ):
        check_type("model", model, mujoco.MjModel)
        check_choice("splitting", splitting, tuple(LANGEVIN))
        self.model = model
        self.kT = read_kT(model, kT)
        self.splitting = splitting
        scheme = LANGEVIN[splitting]
        own = _copy(model, disable)
        steps = "S" in scheme.parts
        if not steps:
            check_tree(own)
        path = BrownianPath(seed, model.opt.timestep) if path is None else path
        self._path = np.array([path.seed, 0, path.factor, path.level], dtype=np.int64)
        if friction is None or not steps:
            found = (model_friction(own), np.zeros((0, model.nv)), 0.0)
        if friction is not None:
            found = read_friction(model, friction)
        _check_damped(own, *found)
        full, rows = _couplings(own, found[0], found[1])
        self._tree = read_tree(own, rows, full=full)
        self._dampers = dampers_with_temperatures(
            own, *found, self.kT, constraints=self._tree.constraints
        )
        _leave_to_us(own, mujoco_steps=steps)
        self._own, self._bare = own, copy.copy(own)
        _set_counts(self._bare, "ngeom", "nsite")
        self._timestep = model.opt.timestep
        self._parts = _table(scheme, model.opt.timestep)
        self._advance = compiled()

    def step(self, data: mujoco.MjData, nstep: int = 1) -> dict[str, float]:
        """Advance the state by steps of the model's timestep.

        This changes `qpos`, `qvel`, `time`, the frames of bodies, geoms and sites, and, unless the
        model has the plugin, `xfrc_applied` of bodies with dipoles. `qfrc_applied`,
        `xfrc_applied` and `ctrl` act as constant forces and controls. It runs without the GIL and
        needs no `magnetism` block. The result has the same bits if the steps are divided among
        several calls. Ctrl-C is checked about every 0.1 s.

        Parameters
        ----------
        data : mujoco.MjData
            Data of this model; `time` selects the step of the Brownian path.
        nstep : int
            Number of steps, less than 2^53.

        Returns
        -------
        dict of str to float
            Heat in J from each bath, under the names of `kT` (or `kT` itself), and `work`, the
            work of all forces. They add up to the change of the kinetic energy.

        Raises
        ------
        ValueError
            The data belong to another model, the timestep was changed, or `nstep` is invalid.
        FloatingPointError
            The motion cannot be followed, or is no longer finite.
        mujoco.FatalError
            The same errors as in `magnetism`.
        """
        check_type("data", data, mujoco.MjData)
        self._check(data)
        remaining = check_integer("nstep", nstep, at_least=0, at_most=LARGEST_STEP - 1)
        room = self._room()
        total, count = np.zeros(len(self.kT) + 1), min(remaining, FIRST_STEPS)
        while True:
            start = time.monotonic()
            self._run(data, 0, count, 1, room, np.empty((0, 0)))
            total += room.exchanged
            remaining -= count
            if not remaining:
                return dict(zip((*self.kT, "work"), total.tolist(), strict=True))
            elapsed = max(time.monotonic() - start, 1e-6)
            count = min(remaining, 1 + int(count * SECONDS_BETWEEN_CHECKS / elapsed))

    def sample(
        self,
        nstep: int,
        *,
        replicas: int = 1,
        every: int = 1,
        settle: int = 0,
        initial: mujoco.MjData | None = None,
    ) -> xr.Dataset:
        """Run replicas on all cores, and record them.

        The result does not depend on the number of cores.

        Parameters
        ----------
        nstep : int
            Number of steps of each replica.
        replicas : int
            Each has its own noise.
        every : int
            Number of steps between two records.
        settle : int
            Number of steps before those, which are not recorded.
        initial : mujoco.MjData, optional
            Initial state, and applied forces and controls; by default those of `mj_resetData`.

        Returns
        -------
        xarray.Dataset
            `qpos` (replica, time, coordinate), `qvel` (replica, time, velocity), `heat` from each
            bath (replica, time, bath) and `work` of all forces (replica, time) in J, since the
            first recorded step began.

        Raises
        ------
        ValueError
            A number is invalid, or the result does not fit in memory.
        FloatingPointError
            The motion cannot be followed, or is no longer finite. The message has the replica and
            the time.
        mujoco.FatalError
            The same errors as in `magnetism`.
        """
        nstep = check_integer("nstep", nstep, at_least=1)
        every = check_integer("every", every, at_least=1, at_most=nstep)
        replicas = check_integer("replicas", replicas, at_least=1)
        settle = check_integer("settle", settle, at_least=0)
        nq, nv, baths = self.model.nq, self.model.nv, len(self.kT)
        records = nstep // every
        shape = replicas, records, nq + nv + baths + 1
        if 8 * np.prod(shape, dtype=float) > physical_memory():
            raise reject("nstep", nstep, f"{replicas} x {records} records do not fit in memory")
        out = np.empty(shape)
        threads = min(replicas, os.cpu_count() or 1)
        stop = threading.Event()
        progress = tqdm(
            total=replicas * (settle + nstep), desc="langevin", unit="step", delay=2, disable=None
        )
        lock = threading.Lock()

        def follow(thread: int) -> None:
            data, room = mujoco.MjData(self.model), self._room()
            for replica in range(thread, replicas, threads):
                if initial is None:
                    mujoco.mj_resetData(self.model, data)
                else:
                    mujoco.mj_copyState(self.model, initial, data, STATE)
                data.time = 0.0
                for target, count in ((None, settle), (out[replica], nstep)):
                    done, size = 0, every
                    base = np.zeros(baths + 1)
                    while done < count and not stop.is_set():
                        start = time.monotonic()
                        size = min(size, count - done)
                        piece = np.empty((0, 0))
                        if target is not None:
                            piece = target[done // every : (done + size) // every]
                        self._run(data, replica, size, every, room, piece)
                        if piece.size:
                            piece[:, nq + nv :] += base
                        base += room.exchanged
                        done += size
                        with lock:
                            progress.update(size)
                        elapsed = max(time.monotonic() - start, 1e-6)
                        faster = int(size * SECONDS_BETWEEN_CHECKS / elapsed) // every
                        size = every * max(1, faster)

        with progress, ThreadPoolExecutor(threads) as pool:
            futures = [pool.submit(follow, thread) for thread in range(threads)]
            try:
                for future in futures:
                    future.result()
            except BaseException:
                stop.set()
                raise
        return xr.Dataset(
            {
                "qpos": (("replica", "time", "coordinate"), out[:, :, :nq]),
                "qvel": (("replica", "time", "velocity"), out[:, :, nq : nq + nv]),
                "heat": (("replica", "time", "bath"), out[:, :, nq + nv : -1]),
                "work": (("replica", "time"), out[:, :, -1]),
            },
            {"time": self._timestep * every * np.arange(1, records + 1), "bath": [*self.kT]},
            {"timestep": self._timestep, "splitting": self.splitting},
        )

    def forces(self, data: mujoco.MjData) -> Array:
        """Return the generalized forces of the position, those of part B.

        This updates the frames in `data`, as `step` does.

        Parameters
        ----------
        data : mujoco.MjData

        Returns
        -------
        ndarray, shape (nv,)
            In N, or N m.

        Raises
        ------
        ValueError, mujoco.FatalError
            As for `step`.
        """
        self._check(data)
        room = self._room()
        self._run(data, 0, 0, 1, room, np.empty((0, 0)))
        return room.force.copy()

    def _room(self) -> Room:
        return room_for(self.model, self._tree, len(self.kT))

    def _check(self, data: mujoco.MjData) -> None:
        if data.model is not self.model:
            raise reject("data.model", data.model, "must be the model of this Langevin")
        if self.model.opt.timestep != self._timestep:
            sentence = f"must still be {self._timestep:g}, since Langevin reads it only once"
            raise reject("timestep", self.model.opt.timestep, sentence)

    def _run(
        self, data: mujoco.MjData, replica: int, count: int, every: int, room: Room, out: Array
    ) -> None:
        """Call the compiled loop, and raise if it ended early."""
        needed = stack_bytes(self.model.nsite, self.model.ntuple) if self.model.nuser_site else 0
        if needed > data.narena - data.parena - data.pstack:
            raise mujoco.FatalError(
                f"the dipoles need {needed} bytes of MuJoCo's memory, which is too small: increase"
                " <size memory>"
            )
        path = self._path.copy()
        path[1] = replica
        with hooks.errors_raised():
            done = self._advance(
                self._own._address, self._bare._address, data._address, self._tree, self._dampers, self._parts, path,
                FROM_TIME, count, every, room, out,
            )  # fmt: skip
        if done < count:
            raise FloatingPointError(
                f"the motion cannot be followed at t = {data.time:g}: the timestep is too long, or"
                " dipoles came too close to each other"
            )


STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def _copy(model: mujoco.MjModel, disable: Sequence[str]) -> mujoco.MjModel:
    """Return a copy of a model in which some features are disabled."""
    names = [f.removeprefix("mjDSBL_").lower() for f in mujoco.mjtDisableBit.__members__]
    own = copy.copy(model)
    for flag in disable:
        check_choice("disable", flag, tuple(n for n in names if not n.startswith("n")))
        own.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}"))
    return own


def _check_damped(model: mujoco.MjModel, friction: Friction, rows: Array, rate: float) -> None:
    """Check that something damps, since else the noise has no power."""
    if model.nv == 0:
        raise reject("number of joints", 0, "must be at least one: nothing can move")
    if not (rate or len(rows) or any(part.any() for part in friction[:4])):
        sentence = (
            "must damp something, or else kT is never reached: add damping to joints or viscosity"
            " to the model's options, or give a rate such as friction=1.0"
        )
        raise reject("friction", 0.0, sentence)


def _couplings(
    model: mujoco.MjModel, friction: Friction, rows: Array
) -> tuple[bool, list[list[int]]]:
    """Return whether dampers may couple any velocities, and those that tendons couple."""
    on_joints = np.isin(model.actuator_trntype, ON_JOINTS)[friction.actuators > 0]
    turns = np.isin(model.jnt_type, [int(mujoco.mjtJoint.mjJNT_BALL)])
    limits = model.tendon_limited.any() or (turns & (model.jnt_limited > 0)).any()
    constraints = (
        (limits and not disabled(model, "limit"))
        or (model.neq and not disabled(model, "equality"))
        or not disabled(model, "contact")
    )
    damped = np.flatnonzero(friction.tendons)
    spans = zip(model.ten_J_rowadr[damped], model.ten_J_rownnz[damped], strict=True)
    coupled = [model.ten_J_colind[start : start + count].tolist() for start, count in spans]
    return bool(constraints or len(rows) or not on_joints.all()), coupled


def _leave_to_us(own: mujoco.MjModel, *, mujoco_steps: bool) -> None:
    """Remove from a model what the compiled loop does itself: friction, gravity, plugins."""
    own.dof_damping[:] = 0
    own.dof_dampingpoly[:] = 0
    own.tendon_damping[:] = 0
    own.tendon_dampingpoly[:] = 0
    own.actuator_damping[:] = 0
    own.actuator_dampingpoly[:] = 0
    own.actuator_biasprm[:, 2] = 0
    own.opt.viscosity = 0
    own.opt.density = 0
    _set_counts(own, "nplugin")
    if not mujoco_steps:
        # A weld has a potential only if its impedance does not depend on the residual.
        welds = own.eq_type == int(mujoco.mjtEq.mjEQ_WELD)
        own.eq_solimp[welds, 1] = own.eq_solimp[welds, 0]
        own.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        own.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
        own.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)


def _set_counts(own: mujoco.MjModel, *names: str) -> None:
    """Set counts of elements to zero, which makes MuJoCo's functions skip them."""
    for name in names:
        place = own._address + getattr(layout.current(), name)
        ctypes.c_int64.from_address(place).value = 0


def _table(scheme: Scheme, timestep: float) -> Array:
    """Return the parts of a scheme as a table for the compiled loop."""
    kicks = any(part in "BK" for part in scheme.parts)
    evaluate = kicks_that_evaluate(scheme.parts) if kicks else [False] * len(scheme.parts)
    takers = [i for i, part in enumerate(scheme.parts) if part in "OK"]
    halves = {takers[0]: 1, takers[1]: -1} if len(takers) == 2 else {}
    return np.array(
        [
            (CODES.index(part), fraction * timestep, new if kicks else -1, halves.get(i, 0))
            for i, (part, fraction, new) in enumerate(
                zip(scheme.parts, scheme.fractions, evaluate, strict=True)
            )
        ],
        dtype=float,
    )
