"""A simulation to watch and change while it moves."""

from contextlib import AbstractContextManager, nullcontext
from typing import Annotated

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice
from magmotor.common.exceptions import ArgumentError, MagmotorError
from magmotor.common.hints import NotNegative, Positive, Seconds, integer
from magmotor.device.device import Scene
from magmotor.device.job import METHODS
from magmotor.live.panel import MOVED, Panel
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import DIPOLES, NOISE
from magmotor.mjcf.magnetism import apply_perturbation, magnetism
from magmotor.noise import check_seed
from magmotor.run.in_mujoco import INTEGRATORS

Steps = Annotated[int, integer(at_least=0, at_most=10**6)]

SWITCHED = {"magnetism": "site_user", "noise": "body_user"}
"""The model array that each switch sets to zero."""

FORCES = {"magnetism": DIPOLES, "noise": NOISE}
"""The bit of each switch in the model's mark."""

BAD = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL,
       mujoco.mjtWarning.mjWARN_BADQACC)  # fmt: skip
"""MuJoCo's warnings about a state that is not finite, or huge."""

START = -0.0
"""Initial time; its sign distinguishes it from the time after the viewer's own reset."""


class StateLost(MagmotorError, RuntimeError):
    """The state is not finite, or the scene no longer describes it."""


class LiveSimulation:
    """A model and its data, advanced frame by frame, with switches, sliders and a reset.

    It starts at keyframe 0 if the model has one.

    Parameters
    ----------
    model : mujoco.MjModel
        Any model; it is changed in place.
    panel : Panel, optional
        The panel of a scene, if the model is its `panel.model()`.
    seed : int
        Seed of the Brownian path, which with the same timestep is the one of `simulate`.

    Attributes
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
    scene : Scene or None
        The scene of the panel.
    sliders : range
        The actuators that sliders control: those of the panel, or all of another model.
    notice : str
        Why a slider was moved back or the motion stopped; empty if all is well.

    Raises
    ------
    ValueError
        The seed is invalid, or the model has no room for it.
    mujoco.FatalError
        The model has an invalid declaration; see `magnetism`.

    Warns
    -----
    UserWarning
        The model has neither magnetism nor noise.
    """

    @checked
    def __init__(self, model: mujoco.MjModel, *, panel: Panel | None = None, seed: int = 0):
        check_seed(seed)
        if seed and model.body_user.any() and not model.nuserdata:
            raise ArgumentError(
                "seed", seed, "must be 0, since the model has noise but no nuserdata to hold a seed"
            )
        self.model, self.data = model, mujoco.MjData(model)
        self.scene = panel.scene if panel else None
        if panel:
            model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.notice = ""
        first = model.nu - len(panel.sliders) if panel else 0
        self.sliders = range(first, model.nu)
        self._panel, self._seed = panel, seed
        self._on = dict.fromkeys(SWITCHED, True)
        self._declared = acting_forces(model)
        names = dict.fromkeys((*MOVED, *SWITCHED.values()))
        self._start = {name: getattr(model, name).copy() for name in names}
        with magnetism():
            mujoco.mj_forward(model, self.data)
        self.reset()

    @property
    def declared(self) -> dict[str, bool]:
        """Whether the model declares magnetism and noise, by name."""
        return {
            name: bool(self._declared & FORCES[name] and self._start[array].any())
            for name, array in SWITCHED.items()
        }

    @property
    def on(self) -> dict[str, bool]:
        """Whether magnetism and noise currently act, by name."""
        return {name: self._on[name] and found for name, found in self.declared.items()}

    @checked
    def switch(self, name: str) -> None:
        """Turn magnetism or noise on or off; friction stays."""
        check_choice("name", name, tuple(SWITCHED))
        self._on[name] = not self._on[name]
        self._write()

    def reset(self) -> None:
        """Restore the initial state, Brownian path and sliders; switches keep their positions."""
        self._arrays = self._start
        self._write()
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        else:
            mujoco.mj_resetData(self.model, self.data)
        self.data.time = self.data.time or START
        self.data.userdata[:1] = self._seed
        self.notice = ""
        self._values = self.data.ctrl[self.sliders.start :].copy()
        self._rest()

    @checked
    def advance(self, steps: Steps, perturb: mujoco.MjvPerturb | None = None) -> None:
        """Take steps.

        Parameters
        ----------
        steps : int
        perturb : mujoco.MjvPerturb, optional
            The viewer's mouse force; see `apply_perturbation`.

        Raises
        ------
        StateLost
            The state is huge or not finite, or the magnets lift a ball that the scene constrains to
            the plane.
        mujoco.FatalError
            See `magnetism`.
        """
        model, data = self.model, self.data
        data.xfrc_applied[:] = 0.0
        with self._acting():
            for _ in range(steps):
                self._follow_script()
                if perturb is not None:
                    apply_perturbation(model, data, perturb)
                mujoco.mj_step(model, data)
        finite = np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all()
        if not finite or any(data.warning[bad].number for bad in BAD):
            raise StateLost(f"the state is not finite at t = {abs(self._time):g}")
        self._check_held()
        self._time = data.time

    @checked
    def hold(self, perturb: mujoco.MjvPerturb) -> None:
        """Take no step; the mouse moves free bodies."""
        mujoco.mjv_applyPerturbPose(self.model, self.data, perturb, 1)
        self._rest()

    def apply_input(self) -> None:
        """Apply the viewer's input since the last step: its reset button and sliders."""
        if self._was_reset():
            self.reset()
        elif self._panel:
            self._apply_sliders(self._panel)

    def _was_reset(self) -> bool:
        """Whether the viewer has reset the data."""
        return repr(self.data.time) != repr(self._time)

    def _apply_sliders(self, panel: Panel) -> None:
        ctrl = self.data.ctrl[self.sliders.start :]
        values = panel.values(ctrl)
        if not np.array_equal(values, self._values):
            try:
                self._move(panel.moved(values))
            except ValueError as error:
                self.notice = str(error)
            else:
                self._values, self.notice = values, ""
        ctrl[:] = self._values

    def _move(self, moved: dict[str, NDArray[np.float64]]) -> None:
        """Write the sliders' arrays into the model; move a mocap body only if its pose changes."""
        for body in np.flatnonzero(self.model.body_mocapid >= 0):
            mocap = self.model.body_mocapid[body]
            for target, name in (("mocap_pos", "body_pos"), ("mocap_quat", "body_quat")):
                if not np.array_equal(moved[name][body], getattr(self.model, name)[body]):
                    getattr(self.data, target)[mocap] = moved[name][body]
        self._arrays = self._arrays | moved
        self._write()

    def _write(self) -> None:
        """Write the settings of sliders and switches into the model."""
        for name, array in self._arrays.items():
            getattr(self.model, name)[:] = array
        for name, array in SWITCHED.items():
            if not self._on[name]:
                getattr(self.model, array)[:] = 0.0

    def _follow_script(self) -> None:
        """Place bodies with prescribed motion as at the middle of the step, as in a run."""
        scene = self.scene
        if scene is not None and scene.device.has_script(scene):
            middle = self.data.time + 0.5 * self.model.opt.timestep
            scene.device.place(scene, self.data, middle)

    def _check_held(self) -> None:
        """Raise StateLost if the scene no longer describes the state."""
        scene = self.scene
        if scene is not None:
            reason = scene.device.why_lost(scene, self.model, self.data)
            if reason:
                raise StateLost(reason)

    def _rest(self) -> None:
        """Compute everything that depends on the state."""
        self._time = self.data.time
        self.data.xfrc_applied[:] = 0.0
        with self._acting():
            mujoco.mj_forward(self.model, self.data)

    def _acting(self) -> AbstractContextManager[None]:
        """Return the context in which forces act; without any, one that does not warn."""
        waves = self.model.jnt_user.any()
        return magnetism() if waves or any(self.on.values()) else nullcontext()


LONGEST_FRAME = 0.2
"""Longest delay (s of wall time) for which a frame catches up, and the longest time that it takes;
any more is skipped."""

MOST_STEPS = 100_000
"""Largest number of steps in a frame; any more is skipped."""


class Pace:
    """Converts wall time into the number of steps that are due.

    Parameters
    ----------
    speed : float
        Simulated seconds per second; may be changed.
    now : float
        Wall time (s).
    """

    @checked
    def __init__(self, speed: NotNegative, now: float):
        self.speed, self._then, self._owed = speed, now, 0.0

    @checked
    def steps(self, now: float, timestep: Positive) -> int:
        """Return how many whole steps are due at a wall time (s), and count them as taken."""
        self._owed += self.speed * min(now - self._then, LONGEST_FRAME)
        self._then = now
        due = int(self._owed / timestep)
        self._owed -= due * timestep
        return min(due, MOST_STEPS)


@checked
def live_scene(
    scene: Scene,
    *,
    method: str = "mujoco/euler",
    timestep: Seconds,
    seed: int = 0,
) -> LiveSimulation:
    """Make a scene live, with sliders for its tilt, height, friction and temperature.

    If it is left alone, it moves as in `simulate`.

    Parameters
    ----------
    scene : Scene
        Its device may compose its model with PyMJCF or as an MjSpec.
    method : str
        `mujoco/euler`, `mujoco/implicitfast` or `mujoco/rk4`.
    timestep : float
        In seconds; for the disk, dimensionless.
    seed : int
        Seed of the Brownian forces.

    Raises
    ------
    ValueError
        Names the argument, its value and the bound.
    """
    check_choice("method", method, METHODS)
    scene.device.check_run(scene, method, timestep, None)
    panel = Panel(scene)
    model = panel.model()
    model.opt.timestep = timestep
    model.opt.integrator = INTEGRATORS[method.split("/")[1]]
    return LiveSimulation(model, panel=panel, seed=seed)
