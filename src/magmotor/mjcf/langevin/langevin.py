"""Langevin dynamics of any MuJoCo model by splitting; see `Langevin`."""

import copy
import math
import os
import threading
import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Annotated, Any

import mujoco
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from tqdm import tqdm

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_choice, check_floats, check_integer, check_type, elements
from magmotor.common.environment import physical_memory
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Count, floats, integer, several
from magmotor.mjcf import hooks
from magmotor.mjcf.forces.magnetic_state import stack_bytes
from magmotor.mjcf.langevin.baths import doubt, read_kT
from magmotor.mjcf.langevin.friction import Friction
from magmotor.mjcf.langevin.linear_limit import largest_timestep
from magmotor.mjcf.langevin.lone_motion import LoneBodies, LoneRoom, room_for_lone_bodies
from magmotor.mjcf.langevin.loop_calls import (
    BY_TIME,
    Steps,
    Taken,
    check_time,
    on_threads,
    pieces,
)
from magmotor.mjcf.langevin.own_model import table_of
from magmotor.mjcf.langevin.prepared import prepared_lone_bodies, prepared_tree
from magmotor.mjcf.langevin.relaxation import Sampling, unsettled
from magmotor.mjcf.langevin.samples import LangevinDiverged, dataset_of, read_sampling
from magmotor.mjcf.langevin.splitting_loop import compiled
from magmotor.mjcf.langevin.supported import check_losses, check_numbers
from magmotor.mjcf.langevin.tree import Room, room_for
from magmotor.mjcf.lookup import potential_checksum
from magmotor.mjcf.unit_system import declares_units
from magmotor.mjcf.wrench_owners import note_wrenches
from magmotor.noise import LARGEST_STEP, BrownianPath
from magmotor.numerics.splittings import LANGEVIN

LARGER = 'increase memory in <size memory="..."/>'
LOSSES = {
    mujoco.mjtWarning.mjWARN_CONTACTFULL: f"there is no memory for all contacts: {LARGER}",
    mujoco.mjtWarning.mjWARN_CNSTRFULL: f"there is no memory for all constraints: {LARGER}",
    mujoco.mjtWarning.mjWARN_BADCTRL: "ctrl must be finite",
}
"""Warnings of MuJoCo after which forces are missing."""

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
"""What `sample` copies of an initial state."""

ALL_OF_STATE = 2 ** int(mujoco.mjtState.mjNSTATE) - 1
"""All bits of `mjtState`."""


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
        rest, and a warning says if they are softened to suit the timestep, as by MuJoCo's flag
        refsafe. The options of the integrator and of the solver have no effect.
    kT : float or mapping of str to float, optional
        Temperature in J; or temperatures of the dampers of the named joints, tendons and bodies (a
        body stands for its joints and for its drag in a fluid), each of which is a bath. By
        default the noise is the model's own, see the notes.
    splitting : {"baoab", "obabo", "middle", "verlet", "o-rk4-o", "o-step-o"}
        The last one consists of steps of MuJoCo itself between friction and noise. With a given
        friction it supports every model, but has the temperature only approximately: constraints,
        dry friction, other dissipation and errors of MuJoCo's integrator change it. All but the
        first need kT, as do `friction`, `seed` and `path`.
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

    Attributes
    ----------
    model : mujoco.MjModel
        The model as given.
    timestep : float
        That of the model, in s.
    effective_model : mujoco.MjModel
        The model that is integrated: with disabled flags, and with soft constraints that suit the
        timestep. Its potential is that of the ensemble.

    Raises
    ------
    ValueError
        A number is invalid, nothing is damped, or something that acts on the model has no law of
        fluctuation and dissipation; without kT, a body is not alone, or damping and noise are not
        constant. The message names the element and what to do.
    LayoutError
        This version of MuJoCo lays out its structs differently than it declares.

    Warns
    -----
    UserWarning
        Soft constraints are softened to suit the timestep, or nothing damps the motion of a tree
        as a whole.

    Notes
    -----
    Friction changes how fast the ensemble settles, not what it becomes, unless the timestep is long
    and the friction weak: a motion that friction damps at the rate g in 1/s needs several times
    1/g, or, if g h is large, about g h steps by the rule of part O (its positions do not wait for
    that). The velocities of an oscillation of angular frequency w have the temperature
    kT (1 - (w h)^2/4) by BAOAB, its positions have kT; if w/g exceeds 50 or so, this holds for
    w h = 0.5 at most. Brownian wrenches (`user` numbers of bodies) do not act with kT.

    B uses the forces at zero velocity; A is Heun's rule or, where that is not accurate enough, the
    classical Runge-Kutta rule in pieces, at conserved kinetic energy; O is the Crank-Nicolson rule.
    BAOAB is due to Leimkuhler and Matthews, J. Chem. Phys. 138, 174102 (2013).

    Without kT, the noise is that of the Brownian wrenches of the model, as in `magnetism`, whose
    path `userdata` selects; a model without them has none. The bodies must be alone: the parent of
    each moving body is the world or a body fixed to it, and its joints are slides followed by at
    most one hinge, ball or free joint at the center of mass. Damping is that of joints and fixed
    tendons, or a viscous contact like that of the planar scenes of `build`. A body with a ball or
    free joint and unequal moments of inertia may have damping, and three equal Brownian torques
    about x, y and z. Then inertia, damping and noise are constant, which saves most of the work: A
    and O are exact (A of second order if three moments of inertia differ). The splitting is BAOAB.

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
    >>> run = mm.Langevin(model, kT=0.5).sample(
    ...     duration=20.0, replicas=4, record_interval=10, burn_in=10.0
    ... )
    >>> run.qpos.shape
    (4, 1000, 1)
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        kT: float | Mapping[str, float] | None = None,
        *,
        splitting: str = "baoab",
        friction: float | ArrayLike | None = None,
        disable: Sequence[str] = (),
        seed: int = 0,
        path: BrownianPath | None = None,
    ):
        check_type("model", model, mujoco.MjModel)
        check_choice("splitting", splitting, tuple(LANGEVIN))
        check_numbers(model)
        check_losses(model)
        self.model, self.timestep, self.splitting = model, model.opt.timestep, splitting
        self._scheme, self._lone = LANGEVIN[splitting], kT is None
        self._steps = "S" in self._scheme.parts
        self._recorded = model.nq + model.nv
        disable = (*elements("disable", disable, "must be flags, such as ['contact']"),)
        named = {"splitting": splitting, "friction": copy.copy(friction), "disable": disable}
        self._arguments = named | {"seed": seed, "path": path}, (model, kT)
        by_seed = BrownianPath(seed, model.opt.timestep)
        self._path = by_seed if path is None else path
        check_type("path", self._path, BrownianPath)
        if not math.isclose(self._path.timestep, model.opt.timestep, rel_tol=1e-9):
            sentence = f"must be the timestep of the model, {model.opt.timestep:g}"
            raise ArgumentError("path.timestep", self._path.timestep, sentence)
        if kT is None:
            given = {"splitting": splitting != "baoab", "friction": friction is not None,
                     "seed": seed != 0, "path": path is not None}  # fmt: skip
            for name in filter(given.get, given):
                value = {**named, "seed": seed, "path": path}[name]
                raise ArgumentError(name, value, "needs kT: without it, the noise is the model's")
            self.kT = {}
            prepared = prepared_lone_bodies(model, disable)
        else:
            self.kT = read_kT(model, kT)
            if not declares_units(model) and (question := doubt(self.kT)):
                warnings.warn(question, stacklevel=2)
            baths = self.kT if isinstance(kT, Mapping) else float(self.kT["kT"])
            prepared = prepared_tree(model, disable, friction, baths, mujoco_steps=self._steps)
        self._own, self.effective_model, self._tree, self._dampers, self._friction = prepared
        self._baths = tuple(self.kT) or ("noise",)
        self._losses = () if self._lone else tuple(LOSSES)
        self._parts = table_of(self._scheme, model.opt.timestep)
        self._path_numbers = np.array([self._path.seed, *self._path.view])
        self._advance = compiled(lone=self._lone)

    def __reduce__(self):
        named, positional = self._arguments
        return partial(Langevin, **named), positional

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
            Data of this model; `time` selects the step of the Brownian path, and without kT,
            `userdata` the path, as in `magnetism`.
        nstep : int
            Number of steps, less than 2^53.

        Returns
        -------
        dict of str to float
            Heat in J from each bath, under the names of `kT` (or `kT` itself, or `noise` without
            kT), and `work`, the work of all forces. They add up to the change of the kinetic
            energy; without kT, a body with three different moments of inertia keeps that of A to
            second order only.

        Raises
        ------
        ValueError
            The data belong to another model, the timestep was changed, or `nstep` is invalid.
        FloatingPointError
            The motion cannot be followed, is not finite, or has reached a speed of 1e10.
        mujoco.FatalError
            The same errors as in `magnetism`.
        """
        check_type("data", data, mujoco.MjData)
        self._check_data(data)
        remaining = check_integer("nstep", nstep, at_least=0)
        if remaining >= LARGEST_STEP:
            raise ArgumentError("nstep", nstep, f"must be less than 2^53 = {LARGEST_STEP}")
        room, following, exchanged = self._room(), BY_TIME, np.zeros(len(self._baths) + 1)
        for _, count in pieces(remaining):
            steps = Steps(following, count, exchanged=exchanged)
            following, exchanged = self._run(data, steps, room)
            if following == BY_TIME or not np.isfinite(exchanged).all():
                raise FloatingPointError(
                    f"the state was lost at t = {data.time:g}: the timestep is too long,"
                    " or dipoles came too close to each other"
                )
        return dict(zip((*self._baths, "work"), exchanged.tolist(), strict=True))

    @checked(finite=False)
    def rollout(
        self,
        data: Annotated[Sequence[mujoco.MjData], several(mujoco.MjData)],
        initial_state: Annotated[Array, floats("replicas", "1 + nq + nv")],
        control: Annotated[Array, floats("replicas", 1, "k")] | None,
        *,
        control_spec: Annotated[int, integer(at_least=0, at_most=ALL_OF_STATE)],
        nstep: Count,
    ) -> Array:
        """Run replicas in parallel, as `mujoco.rollout.rollout` does.

        Parameters
        ----------
        data : sequence of mujoco.MjData
            Data of this model, one for each thread.
        initial_state : ndarray, shape (replicas, 1 + nq + nv)
            `time`, `qpos` and `qvel` of each replica. With kT, each has its own noise; without, it
            has that of `userdata`, which `control` can set for each replica.
        control : ndarray, shape (replicas, 1, k), optional
            Further elements of each replica's state, constant during the run.
        control_spec : int
            The elements in `control`, as bits of `mjtState`.
        nstep : int
            Number of steps.

        Returns
        -------
        ndarray, shape (replicas, nstep, nq + nv)
            `qpos` and `qvel` after each step; NaN once the state is lost.

        Raises
        ------
        ValueError
            The data belong to another model, the shape of an array does not match the model, or
            the result does not fit in memory.
        mujoco.FatalError
            The same errors as in `magnetism`.
        """
        for used in data:
            self._check_data(used)
        if len({id(used) for used in data}) < len(data):
            raise ArgumentError(
                "data", data, "must not contain one mjData twice: each is for one thread"
            )
        width = 1 + self.model.nq + self.model.nv
        check_floats("initial_state", initial_state, "replicas", width)
        size = mujoco.mj_stateSize(self.model, control_spec)
        if control is not None:
            check_floats("control", control, "replicas", 1, size)
        most = physical_memory() / (8 * max(1, len(initial_state) * self._recorded))
        if nstep > most:
            raise ArgumentError("nstep", nstep, f"must be at most {int(most)} to fit in memory")
        start = np.split(initial_state, [1, 1 + self.model.nq], axis=1)
        paths = np.empty((len(initial_state), nstep, self._recorded))

        def follow(thread: int, stop: threading.Event) -> None:
            used, room = data[thread], self._room()
            for replica in range(thread, len(paths), len(data)):
                (used.time,), used.qpos[:], used.qvel[:] = (part[replica] for part in start)
                used.qacc_warmstart[:] = 0
                if control is not None:
                    mujoco.mj_setState(self.model, used, control[replica, 0], control_spec)
                following, own = BY_TIME, 0 if self._lone else replica
                for done, count in pieces(nstep, stop=stop):
                    records = paths[replica, done : done + count]
                    records[:] = np.nan
                    steps = Steps(following, count, replica=own, records=records)
                    following = self._run(used, steps, room).following
                    if following == BY_TIME:
                        paths[replica, done + count :] = np.nan
                        break

        self._compile()
        on_threads(follow, len(data), len(data))
        return paths

    def sample(
        self,
        duration: float,
        *,
        replicas: int = 1,
        record_interval: int = 1,
        burn_in: float = 0.0,
        initial: mujoco.MjData | None = None,
    ) -> xr.Dataset:
        """Run replicas on all cores, and record them.

        The result does not depend on the number of cores.

        Parameters
        ----------
        duration : float
            Time of each replica in s, in whole steps that end with the last record.
        replicas : int
            Each has its own noise, without kT that of the replica in `userdata` plus its number.
        record_interval : int
            Record every n-th step.
        burn_in : float
            Time before that, in s, to the nearest step, which is not recorded.
        initial : mujoco.MjData, optional
            Initial state, and applied forces and controls; by default those of `mj_resetData`.

        Returns
        -------
        xarray.Dataset
            `qpos` (replica, time, coordinate), `qvel` (replica, time, velocity), `heat` from each
            bath (replica, time, bath) and `work` of all forces (replica, time) in J, since the
            first recorded step began; and `ctrl` and applied forces, if there are any.

        Raises
        ------
        ValueError
            A number is invalid, or the result does not fit in memory.
        LangevinDiverged
            The motion of some replicas could not be followed. The error contains all records.
        mujoco.FatalError
            The same errors as in `magnetism`.

        Warns
        -----
        UserWarning
            By small motions about the initial position, the records contain on average too much of
            the energy with which some motion starts: more than a tenth, or more than 1 % and the
            standard error of this energy. All replicas start alike, so that their mean is not that
            of equilibrium, and their spread is too small an error. Positions are judged where the
            forces are nearly linear, within a thermal displacement of an equilibrium near the
            initial position, unless something is driven away from there. How long others need is
            not known, such as free ones and those that must cross barriers. Of more than 500
            velocities, only the one with the weakest friction is judged and no position, by
            "o-step-o" only velocities. Without kT, nothing is judged.
        """
        sampling = read_sampling(self.timestep, duration, replicas, record_interval, burn_in)
        if initial is not None:
            check_type("initial", initial, mujoco.MjData)
            self._check_data(initial)
        shape = replicas, sampling.records, self.model.nq + self.model.nv + len(self._baths) + 1
        if 8 * np.prod(shape, dtype=float) > physical_memory():
            sentence = f"{replicas} x {sampling.records} records do not fit in memory"
            raise ArgumentError("duration", duration, sentence)
        self._compile()
        if self._friction and (kT := max(self.kT.values())):
            forces = None if self._steps else self.forces
            start = self._start(initial)
            if warning := unsettled(
                self.model, start, self._friction, self._scheme, forces, kT, sampling
            ):
                warnings.warn(warning, stacklevel=2)
        out = np.full(shape, np.nan)
        lost: dict[int, float] = {}
        with tqdm(
            total=replicas * (sampling.burn_in + sampling.nstep), desc="Langevin", unit="step",
            delay=2, disable=None,
        ) as progress:  # fmt: skip
            follow = partial(self._follow, out, lost, sampling, initial, progress)
            on_threads(follow, replicas, min(replicas, os.cpu_count() or 1))
        run = dataset_of(
            out, self.model, self._baths, record_interval, initial, splitting=self.splitting,
            potential=potential_checksum(self.effective_model),
        )  # fmt: skip
        if lost:
            replica, when = min(lost.items())
            raise LangevinDiverged(replica, when, len(lost), run)
        return run

    def _follow(
        self,
        out: Array,
        lost: dict[int, float],
        sampling: Sampling,
        initial: mujoco.MjData | None,
        progress: Any,
        replica: int,
        stop: threading.Event,
    ) -> None:
        """Run one replica, in calls of about 0.1 s."""
        data, room = self._start(initial), self._room()
        data.time, following, every = 0.0, 0, sampling.interval
        burn_in = out[replica, :0], sampling.burn_in
        for records, count in (burn_in, (out[replica], sampling.nstep)):
            exchanged = np.zeros(len(self._baths) + 1)
            for done, size in pieces(count, every, stop):
                piece = records[done // every : (done + size) // every]
                steps = Steps(following, size, min(size, every), replica, exchanged, piece)
                following, exchanged = self._run(data, steps, room)
                if following == BY_TIME or not np.isfinite(exchanged).all():
                    lost[replica] = data.time - sampling.burn_in * self.timestep
                    return
                progress.update(size)

    def _start(self, initial: mujoco.MjData | None) -> mujoco.MjData:
        data = mujoco.MjData(self.model)
        if initial is not None:
            mujoco.mj_copyState(self.model, initial, data, STATE)
        return data

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
        self._parts_friction()
        check_type("data", data, mujoco.MjData)
        self._check_data(data)
        room = self._room()
        self._run(data, Steps(0, 0), room)
        if not np.isfinite(room.force).all():
            sentence = "must be finite, and so must be positions and applied forces in data"
            raise ArgumentError("forces", room.force.tolist(), sentence)
        return room.force

    def largest_timestep(self, data: mujoco.MjData) -> float:
        """Return the smallest unstable timestep of small motions about a position, in s.

        By linear theory, with the inertia, the friction and the derivatives of the forces at this
        position; best at an equilibrium. The result is infinite if there is none.

        Parameters
        ----------
        data : mujoco.MjData

        Returns
        -------
        float

        Raises
        ------
        ValueError
            The data belong to another model, the splitting consists of steps of MuJoCo, or kT was
            not given.
        """
        friction = self._parts_friction()
        check_type("data", data, mujoco.MjData)
        self._check_data(data)
        return largest_timestep(self.model, data, self.forces, friction, self._scheme)

    def _parts_friction(self) -> Friction:
        """Return the friction, after a check that there are parts to be looked at alone."""
        if self._steps:
            raise ArgumentError("splitting", self.splitting, "must not consist of steps of MuJoCo")
        if self._friction is None:
            sentence = "must be given for this: without kT, Langevin only takes steps"
            raise ArgumentError("kT", None, sentence)
        return self._friction

    def _run(self, data: mujoco.MjData, steps: Steps, room: Room | LoneRoom) -> Taken:
        """Call the compiled loop; see `advance` in `magmotor.mjcf.langevin.splitting_loop`."""
        first = steps.first
        if first == BY_TIME:
            check_time(data, self.timestep)
            first = math.floor(data.time / self.timestep + 0.5)
        self._check_run(data)
        before = [data.warning[kind].number for kind in self._losses]
        room.exchanged[:] = steps.exchanged
        with hooks.errors_raised():
            done = self._advance(*self._loop_arguments(data._address, first, steps, room))
        note_wrenches(self.model, data)
        for kind, count in zip(self._losses, before, strict=True):
            if data.warning[kind].number > count:
                raise mujoco.FatalError(f"at t = {data.time:g}: {LOSSES[kind]}")
        return Taken(first + done if done == steps.nstep else BY_TIME, room.exchanged.copy())

    def _compile(self) -> None:
        """Compile the loop, before threads call it."""
        self._advance.compile_for(*self._loop_arguments(0, 0, Steps(0, 0), self._room()))

    def _room(self) -> Room | LoneRoom:
        """Return scratch memory for one thread."""
        if isinstance(self._tree, LoneBodies):
            return room_for_lone_bodies(self._tree)
        return room_for(self.model, self._tree, len(self._baths))

    def _loop_arguments(
        self, data: int, first: int, steps: Steps, room: Room | LoneRoom
    ) -> tuple[Any, ...]:
        return (
            self._own._address, data, self._tree, self._dampers, self._parts, self._path_numbers,
            steps.replica, first, steps.nstep, steps.every, room, steps.records,
        )  # fmt: skip

    def _check_data(self, data: mujoco.MjData) -> None:
        if data.model is not self.model:
            raise ArgumentError("data.model", data.model, "must be the model of this Langevin")

    def _check_run(self, data: mujoco.MjData) -> None:
        """Check the timestep, the memory for the dipoles, and that no callback of the user acts.

        The forces of callbacks have no known potential. For lone bodies, none is called.
        """
        if self.model.opt.timestep != self.timestep:
            raise ArgumentError(
                "timestep",
                self.model.opt.timestep,
                f"must still be {self.timestep:g}, since Langevin reads it only once",
            )
        needed = stack_bytes(self.model)
        if needed > data.narena - data.parena - data.pstack:
            raise mujoco.FatalError(
                f"size memory of the model = {data.narena}: must be larger by about {needed}"
                " bytes, for the dipoles"
            )
        forbidden = [] if self._lone else ["passive"] + ["control"] * (self._steps)
        for name in forbidden:
            if getattr(mujoco, f"get_mjcb_{name}")() is not None:
                sentence = "must not be set (by magnetism(), either) while this Langevin runs"
                raise ArgumentError(f"mjcb_{name}", "a function", sentence)


def record_exchange(langevin: Langevin) -> None:
    """Make `rollout` also return `qpos` at part O, and `qvel` before and after it."""
    assert langevin._lone  # the loop for trees has no such records
    langevin._recorded = 2 * langevin.model.nq + 3 * langevin.model.nv
