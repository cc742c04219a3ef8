"""Langevin dynamics of any MuJoCo model by splitting; see `Langevin`."""

import copy
import math
import os
import threading
import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import mujoco
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from tqdm import tqdm

from magmotor.common.arrays import Array
from magmotor.common.checks import check_choice, check_integer, check_number, check_type, elements
from magmotor.common.environment import physical_memory
from magmotor.common.exceptions import ArgumentError, MagmotorError
from magmotor.mjcf import hooks
from magmotor.mjcf.langevin.baths import (
    dampers_with_temperatures,
    doubt,
    read_friction,
    read_kT,
)
from magmotor.mjcf.langevin.friction import model_friction
from magmotor.mjcf.langevin.linear_limit import largest_timestep
from magmotor.mjcf.langevin.loose_motion import loose_motions
from magmotor.mjcf.langevin.own_model import (
    check_damped,
    check_inertia,
    copy_with,
    couplings,
    leave_to_us,
    skip_plugins,
    table_of,
    without_friction,
)
from magmotor.mjcf.langevin.refusals import refusal_with_remedies
from magmotor.mjcf.langevin.relaxation import Sampling, unsettled
from magmotor.mjcf.langevin.softening import soften
from magmotor.mjcf.langevin.splitting_loop import compiled
from magmotor.mjcf.langevin.supported import check_all_numbers, check_tree
from magmotor.mjcf.langevin.thermostat import (
    BY_TIME,
    Steps,
    Taken,
    Thermostat,
    on_threads,
    pieces,
)
from magmotor.mjcf.langevin.tree import Room, read_tree, room_for
from magmotor.mjcf.lookup import potential_checksum
from magmotor.mjcf.overwritten import note_wrenches
from magmotor.mjcf.unit_system import declares_units
from magmotor.noise import LARGEST_STEP, BrownianPath
from magmotor.numerics.compilation_notice import compile_here
from magmotor.numerics.splittings import LANGEVIN

APPLIED = {
    "ctrl": ("control",),
    "qfrc_applied": ("velocity",),
    "xfrc_applied": ("body", "component"),
}
"""What acts from outside, by its name in mjData, and its dimensions."""

LOSSES = {
    mujoco.mjtWarning.mjWARN_CONTACTFULL: "there is no memory for all contacts: increase <size>",
    mujoco.mjtWarning.mjWARN_CNSTRFULL: "there is no memory for all constraints: increase <size>",
    mujoco.mjtWarning.mjWARN_BADCTRL: "ctrl must be finite",
}
"""Warnings of MuJoCo after which forces are missing."""

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
"""What `sample` copies of an initial state."""


class LangevinDiverged(MagmotorError, FloatingPointError):
    """The motion of a replica could not be followed, was no longer finite, or became huge.

    Attributes
    ----------
    replica : int
        The first such replica.
    time : float
        When it was lost, in s.
    dataset : xarray.Dataset
        Records of all replicas, with NaN where there are none.
    """

    def __init__(self, replica: int, time: float, replicas: int, dataset: xr.Dataset):
        self.replica, self.time, self.dataset = replica, time, dataset
        self._replicas = replicas
        others = f", and {replicas - 1} others later or elsewhere" if replicas > 1 else ""
        when = f"at t = {time:g}" if time > 0 else f"{-time:g} s before the first record"
        super().__init__(
            f"replica {replica} was lost {when}{others}: the timestep is too long (see"
            " largest_timestep, also where limits and contacts act), dipoles came too close to each"
            " other, or nothing bounds the energy from below; `dataset` contains what was recorded"
        )

    def __reduce__(self):
        return type(self), (self.replica, self.time, self._replicas, self.dataset)


def _check(own: mujoco.MjModel, *, mujoco_steps: bool, all_friction: bool) -> None:
    """Check the forces of a model, unless MuJoCo takes the steps, and its friction."""
    if not mujoco_steps:
        check_tree(own)
        check_inertia(own)
    if all_friction or not mujoco_steps:
        model_friction(own if all_friction else without_friction(own))


class Langevin(Thermostat):
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
    kT : float or mapping of str to float
        Temperature in J; or temperatures of the dampers of the named joints, tendons and bodies (a
        body stands for its joints and for its drag in a fluid), each of which is a bath.
    splitting : {"baoab", "obabo", "middle", "verlet", "o-rk4-o", "o-step-o"}
        The last one consists of steps of MuJoCo itself between friction and noise. With a given
        friction it supports every model, but has the temperature only approximately: constraints,
        dry friction, other dissipation and errors of MuJoCo's integrator change it.
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
        fluctuation and dissipation. The message names the element and what to do.
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
    w h = 0.5 at most. Brownian wrenches of the model (`user` numbers of bodies) do not act.

    B uses the forces at zero velocity; A is Heun's rule or, where that is not accurate enough, the
    classical Runge-Kutta rule in pieces, at conserved kinetic energy; O is the Crank-Nicolson rule.
    BAOAB is due to Leimkuhler and Matthews, J. Chem. Phys. 138, 174102 (2013).

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
        kT: float | Mapping[str, float],
        *,
        splitting: str = "baoab",
        friction: float | ArrayLike | None = None,
        disable: Sequence[str] = (),
        seed: int = 0,
        path: BrownianPath | None = None,
    ):
        super().__init__(model)
        check_choice("splitting", splitting, tuple(LANGEVIN))
        self.kT = read_kT(model, kT)
        if not declares_units(model) and (question := doubt(self.kT)):
            warnings.warn(question, stacklevel=2)
        self.splitting = splitting
        scheme = LANGEVIN[splitting]
        check_all_numbers(model)
        disable = (*elements("disable", disable, "must be flags, such as ['contact']"),)
        own = copy_with(model, disable)
        steps = "S" in scheme.parts
        given = None if friction is None else read_friction(model, friction)
        check = partial(_check, mujoco_steps=steps, all_friction=given is None)
        try:
            check(own)
        except ValueError as error:
            raise refusal_with_remedies(model, disable, check, error) from None
        if not steps:
            soften(own)
        given = model_friction(own) if given is None else given
        self.effective_model = copy.copy(own)
        by_seed = BrownianPath(seed, model.opt.timestep)
        self._path = by_seed if path is None else path
        check_type("path", self._path, BrownianPath)
        if not math.isclose(self._path.timestep, model.opt.timestep, rel_tol=1e-9):
            sentence = f"must be the timestep of the model, {model.opt.timestep:g}"
            raise ArgumentError("path.timestep", self._path.timestep, sentence)
        check_damped(own, given)
        for warning in loose_motions(own, given, mujoco_steps=steps):
            warnings.warn(warning, stacklevel=2)
        self._friction, self._scheme = given, scheme
        named = {"splitting": splitting, "friction": copy.copy(friction), "disable": disable}
        self._arguments = named | {"seed": seed, "path": path}, (model, kT)
        full, rows = couplings(own, given)
        self._tree = read_tree(own, rows, full=full, mujoco_steps=steps)
        self._dampers = dampers_with_temperatures(
            own,
            given,
            self.kT if isinstance(kT, Mapping) else float(self.kT["kT"]),
            constraints=self._tree.constraints,
        )
        leave_to_us(own, mujoco_steps=steps, all_friction=not steps or friction is None)
        skip_plugins(own)
        self._own = own
        self._parts = table_of(scheme, model.opt.timestep)
        self._advance = compiled()

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
            The motion cannot be followed, is not finite, or has reached a speed of 1e10.
        mujoco.FatalError
            The same errors as in `magnetism`.
        """
        sums = self._steps(data, nstep, np.zeros(len(self.kT) + 1))
        return dict(zip((*self.kT, "work"), sums.tolist(), strict=True))

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
            Each has its own noise.
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
            "o-step-o" only velocities.
        """
        sampling = self._sampling(duration, replicas, record_interval, burn_in)
        if initial is not None:
            check_type("initial", initial, mujoco.MjData)
            self._check_data(initial)
        shape = replicas, sampling.records, self.model.nq + self.model.nv + len(self.kT) + 1
        if 8 * np.prod(shape, dtype=float) > physical_memory():
            sentence = f"{replicas} x {sampling.records} records do not fit in memory"
            raise ArgumentError("duration", duration, sentence)
        self._compile()
        if kT := max(self.kT.values()):
            forces = None if "S" in self._scheme.parts else self.forces
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
        run = self._dataset(out, record_interval, initial)
        if lost:
            replica, when = min(lost.items())
            raise LangevinDiverged(replica, when, len(lost), run)
        return run

    def _sampling(
        self, duration: float, replicas: int, record_interval: int, burn_in: float
    ) -> Sampling:
        """Check the numbers of a sample, and return them in steps."""
        h = self.timestep
        duration = check_number("duration", duration, at_least=h, unit="s (one timestep)")
        nstep = int(duration / h * (1 + 1e-12))
        interval = check_integer("record_interval", record_interval, at_least=1, at_most=nstep)
        burn_in = check_number("burn_in", burn_in, at_least=0, unit="s")
        for name, value in (("duration", duration), ("burn_in", burn_in)):
            if value / h >= LARGEST_STEP:
                raise ArgumentError(name, value, "must be less than 2^53 timesteps")
        return Sampling(
            round(burn_in / h), interval, nstep // interval,
            check_integer("replicas", replicas, at_least=1),
        )  # fmt: skip

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
        data = self._start(initial)
        data.time, following, every = 0.0, 0, sampling.interval
        burn_in = out[replica, :0], sampling.burn_in
        for records, count in (burn_in, (out[replica], sampling.nstep)):
            exchanged = np.zeros(len(self.kT) + 1)
            for done, size in pieces(count, every, stop):
                piece = records[done // every : (done + size) // every]
                steps = Steps(following, size, min(size, every), replica, exchanged, piece)
                following, exchanged = self._run(data, steps)
                if following == BY_TIME or not np.isfinite(exchanged).all():
                    lost[replica] = data.time - sampling.burn_in * self.timestep
                    return
                progress.update(size)

    def _start(self, initial: mujoco.MjData | None) -> mujoco.MjData:
        data = mujoco.MjData(self.model)
        if initial is not None:
            mujoco.mj_copyState(self.model, initial, data, STATE)
        return data

    def _dataset(self, out: Array, every: int, initial: mujoco.MjData | None) -> xr.Dataset:
        nq, nv = self.model.nq, self.model.nv
        times = self.timestep * every * np.arange(1, out.shape[1] + 1)
        run = xr.Dataset(
            {
                "qpos": (("replica", "time", "coordinate"), out[:, :, :nq]),
                "qvel": (("replica", "time", "velocity"), out[:, :, nq : nq + nv]),
                "heat": (("replica", "time", "bath"), out[:, :, nq + nv : -1]),
                "work": (("replica", "time"), out[:, :, -1]),
            },
            {"time": times, "bath": [*self.kT]},
            {
                "timestep": self.timestep,
                "splitting": self.splitting,
                "potential": potential_checksum(self.effective_model),
            },
        )
        for name, axes in APPLIED.items():
            if initial is not None and getattr(initial, name).any():
                run[name] = axes, getattr(initial, name).copy()
        return run

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
        self._check_parts()
        check_type("data", data, mujoco.MjData)
        self._check_data(data)
        force = self._call(data, Steps(first=0, nstep=0))[1].force
        if not np.isfinite(force).all():
            sentence = "must be finite, and so must be positions and applied forces in data"
            raise ArgumentError("forces", force.tolist(), sentence)
        return force

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
            The data belong to another model, or the splitting consists of steps of MuJoCo.
        """
        self._check_parts()
        check_type("data", data, mujoco.MjData)
        self._check_data(data)
        return largest_timestep(self.model, data, self.forces, self._friction, self._scheme)

    def _check_parts(self) -> None:
        if "S" in self._scheme.parts:
            raise ArgumentError("splitting", self.splitting, "must not consist of steps of MuJoCo")

    def _run(self, data: mujoco.MjData, steps: Steps) -> Taken:
        """Call the compiled loop; see `advance` in `magmotor.mjcf.langevin.splitting_loop`."""
        if steps.first == BY_TIME:
            if not abs(data.time / self.timestep) < LARGEST_STEP:
                raise ArgumentError("data.time", data.time, "must be less than 2^53 timesteps")
            steps = steps._replace(first=math.floor(data.time / self.timestep + 0.5))
        done, room = self._call(data, steps)
        following = steps.first + done if done == steps.nstep else BY_TIME
        return Taken(following, room.exchanged)

    def _call(self, data: mujoco.MjData, steps: Steps) -> tuple[int, Room]:
        """Return the number of steps that succeeded, and the scratch memory."""
        self._check_run(data)
        self._check_callbacks()
        before = [data.warning[kind].number for kind in LOSSES]
        room = room_for(self.model, self._tree, len(self.kT))
        room.exchanged[: len(steps.exchanged)] = steps.exchanged
        with hooks.errors_raised():
            done = self._advance(*self._loop_arguments(data._address, steps, room))
        note_wrenches(self.model, data)
        for kind, count in zip(LOSSES, before, strict=True):
            if data.warning[kind].number > count:
                raise mujoco.FatalError(f"at t = {data.time:g}: {LOSSES[kind]}")
        return done, room

    def _compile(self) -> None:
        room = room_for(self.model, self._tree, len(self.kT))
        compile_here(self._advance, *self._loop_arguments(0, Steps(0, 0), room))

    def _loop_arguments(self, data: int, steps: Steps, room: Room) -> tuple[Any, ...]:
        path = np.array([self._path.seed, steps.replica, *self._path.view])
        return (
            self._own._address, data, self._tree, self._dampers, self._parts, path, steps.first,
            steps.nstep, steps.every, room, steps.records,
        )  # fmt: skip

    def _check_callbacks(self) -> None:
        """Check that no callback of the user acts, whose forces have no known potential."""
        forbidden = ["passive"] + ["control"] * ("S" in self._scheme.parts)
        for name in forbidden:
            if getattr(mujoco, f"get_mjcb_{name}")() is not None:
                sentence = "must not be set (by magnetism(), either) while this Langevin runs"
                raise ArgumentError(f"mjcb_{name}", "a function", sentence)
