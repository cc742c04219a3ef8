"""A `with` block in which dipoles, noise and potentials act on every model.

The module contains the public functions and the installation of the compiled callback.
"""

import ctypes
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache, wraps
from types import FrameType
from typing import Any, ParamSpec, TypeVar

import mujoco

from magmotor.common.arguments import checked
from magmotor.mjcf import error_raising
from magmotor.mjcf.callbacks import compiled_callback, users_callback
from magmotor.mjcf.hooks import Hook
from magmotor_plugin.library import library

P = ParamSpec("P")
R = TypeVar("R")


def magnetism() -> "Block":
    """Apply magnetism, Brownian wrenches and periodic potentials inside a `with` block.

    They act on every MuJoCo model that declares them in its MJCF, and says so by a mark:

        <custom><text name="magmotor" data="dipoles couplings noise potentials"/></custom>

    Each word lets one of these act, and `all` lets all of them:

    - `dipoles`: a dipole is a site with `user="MOMENT"`, in A m^2 along the site's z axis. Dipoles
      of one rigid body (a body and the bodies attached to it without a joint, regardless of any
      `<equality>`) do not act on each other.
    - `couplings`: a `<custom>` tuple named `coupling...` scales the interaction of two bodies (see
      Notes).
    - `noise`: Brownian wrenches are rows of six numbers in a body's `user`: force x y z in
      N sqrt(s) and torque x y z in N m sqrt(s), in the world frame at the center of mass.
      Independent white noise multiplies each row. `mjData.userdata` contains, up to the model's
      `nuserdata`, the seed, the replica, factor and level of a `BrownianPath` (its `view`), and
      the path's step at time 0. See Notes on rollouts and resets.
    - `potentials`: `user="a_1 b_1 a_2 b_2 ..."` gives a slide or hinge joint, at q in m or rad, the
      potential sum_k a_k sin kq + b_k cos kq, in J.
    - `fields`: numerics named `field...` are applied fields: B in T (3 numbers), B and its
      derivatives G_xx G_xy G_xz G_yy G_yz in T/m (8), or a table (see `tabulated_field`). A tuple
      `field...` names them and fixes them to a body or a site, or lets an actuator scale them.
    - `coils`: a tuple named `coil...` lists an actuator, then geoms, sites or bodies, whose moments
      or polarizations are their `user` numbers times the actuator's last activation, or its
      control. A geom has a winding on its side. A control that is set between `mj_step1` and
      `mj_step2` acts in the next step only (with the plugin, at once).
    - `magnets`: a geom with `user="J_x J_y J_z"`, its polarization in T along its own axes, is a
      magnet of its shape, which may also be a capsule or a convex mesh.
    - `iron`: a tuple named `iron...` lists a numeric, the susceptibility and optionally the
      saturation magnetization in A/m and the distance of nodes in m, and geoms. The field at its
      nodes magnetizes a geom, or several that touch as one; a plane mirrors.
    - `conductors`: a tuple named `conductor...` lists a numeric, the conductivity in S/m and
      optionally the thickness in m, and planes, above which eddy currents brake magnets that move.
    - `hysteresis`: a tuple named `hysteresis...` lists a numeric, the coercivity in A/m and the
      remanence over the saturation, and sites, whose moments are those at saturation. It needs the
      plugin `magmotor.forces`, which stores what they remember.

    Names of elements that a tuple lists must not contain spaces.

    In other units than those of SI, a numeric says what the magnetic constant mu0 is. In um, pg, ms
    and uA, where energies are in zJ and fields in mT (other systems: docs/units.md):

        <custom><numeric name="magnetic_constant" data="1.2566370614e-3"/></custom>

    Without a mark, `user` numbers may have another meaning. Then only dipoles act, and only if no
    body or joint has `user` numbers, no site has more than one, and these do not merely number the
    sites; a line on stderr says so, once per process.

    The wrenches of magnetism and noise overwrite `xfrc_applied` of the bodies on which they act; a
    warning names one whose row you have set (of the first 496). The forces of potentials are added
    to `qfrc_passive`.

    The callback is installed as `mjcb_control` for all models and threads of the process, and the
    previous callback is restored at the end. Blocks may be nested and may overlap in several
    threads. The callback works with `mj_step`, `mj_forward`, `mujoco.rollout`,
    `mujoco.batch.Batch` and the viewer, without the GIL. MuJoCo has only one control callback: one
    that was installed before runs inside the block, too, before the forces are computed (a `Batch`
    accepts one in C only); calling `mujoco.set_mjcb_control` inside the block replaces this one,
    which is a warning at the end.

    After the block, `xfrc_applied` still contains the last forces, and MuJoCo continues to apply
    them; set it to zero. The viewer's `sync` does this after each step.

    A model with the engine plugin `magmotor.forces` needs no block, and is left to it inside one.

    Returns
    -------
    context manager
        It also decorates functions, which then run inside such a block.

    Warns
    -----
    UserWarning
        Once per block and reason, when a model is stepped on which nothing acts (the warning states
        the reason), when a force set in `xfrc_applied` is overwritten, or when a text is nearly a
        mark. Also if the result is discarded without a `with` block, and at the end of a block in
        which `mujoco.set_mjcb_control` has replaced the callback.

    Raises
    ------
    LayoutError
        This version of MuJoCo lays out its structs differently than it declares.
    mujoco.FatalError
        While stepping: two dipoles that act on each other coincide, one leaves the table of a field
        or is below the plane of iron or of a conductor, iron is so close to iron that the moments
        have no solution, the mark has no words or an unknown one, or what it names is invalid: the
        `user` numbers of a site are not one finite moment, those of a body not rows of six, or
        those of a joint not pairs; a joint with a potential is neither slide nor hinge; the
        tolerance is not one number from 0 to 0.1; the magnetic constant is not one positive finite
        number; the elements of a coupling are not two bodies with equal `prm`; or a number in
        `userdata` is invalid. MuJoCo pads all lists to the longest in the model with zeros, which
        are ignored. On the threads of a rollout, nothing can be raised: the positions of the failed
        run are NaN from there on, and the error is raised at the end of the block. A `Batch` raises
        a `SimulationError` instead, and keeps the failed states as they were before the call.

    Notes
    -----
    The forces are those of point dipoles: F = grad(m.B), torque m x B. A coupling multiplies both
    by `prm` between the two bodies that it names (one may be `world`), but not between bodies
    attached to these. A factor of 0, MuJoCo's default for `prm`, turns them off. The factors of
    several couplings of one pair multiply:

        <custom>
          <tuple name="coupling of ball and ring">
            <element objtype="body" objname="ball" prm="2"/>
            <element objtype="body" objname="ring" prm="2"/>
          </tuple>
        </custom>

    From 256 free dipoles on, each pair is computed once, by all threads of the `mjData` that
    `mujoco.mju_threadpool` gave it, with the same bits for any number. A numeric lets distant
    dipoles act as clusters, with errors of force and field below a part of their RMS:

        <custom><numeric name="magnetic_tolerance" data="1e-3"/></custom>

    The noise of a step is constant over the stages of RK4. The number of a step is the time over
    the timestep, so that noise repeats or is skipped if the timestep changes during a run.

    `mj_resetData` sets `userdata`, and thus the seed, to zero. The initial state of a rollout does
    not include `userdata`: pass (seed, replica) of each trajectory as a control with
    `control_spec=mjSTATE_USERDATA`, or else all trajectories of a thread have the noise of its
    `mjData`. A `Batch` has an array `userdata`.

    With noise alpha and damping c, of rate lambda = c/m, the temperature for small steps h is
    kT = alpha^2/(2c). With `mj_step`, it is kT/(1 + lambda h/2) where MuJoCo's damping is implicit:
    joints in Euler and implicitfast, tendons in implicitfast. It is kT/(1 - lambda h/2), for
    lambda h < 2, for viscous contacts, and for tendons in Euler. With RK4 it is about
    kT (1 - (lambda h)^2/12), for lambda h < 2.785. `Langevin` gives kT for any lambda h.

    The flag `actuation` must not be disabled, since MuJoCo would then skip the callback.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> model = mujoco.MjModel.from_xml_string('''
    ... <mujoco>
    ...   <custom><text name="magmotor" data="dipoles"/></custom>
    ...   <worldbody>
    ...     <site pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    ...     <body>
    ...       <joint type="hinge" axis="0 0 1" damping="1e-4"/>
    ...       <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
    ...       <site zaxis="1 0 0" user="0.2"/>
    ...     </body>
    ...   </worldbody>
    ... </mujoco>
    ... ''')
    >>> data = mujoco.MjData(model)
    >>> with mm.magnetism():
    ...     mujoco.mj_step(model, data, nstep=5000)
    >>> print(data.qpos.round(5))  # a quarter of a turn: the needle points at the magnet
    [1.5708]
    """
    return Block(sys._getframe(1))


class Block:
    """The `with` block of `magnetism`, which warns if it never begins."""

    def __init__(self, caller: FrameType):
        self._place = caller.f_code.co_filename, caller.f_lineno
        self._unused = True
        self._open: list[AbstractContextManager[None]] = []

    def __enter__(self) -> None:
        self._unused = False
        acting = _acting()
        acting.__enter__()
        self._open.append(acting)

    def __exit__(self, *error: Any) -> bool | None:
        return self._open.pop().__exit__(*error)

    def __call__(self, function: Callable[P, R]) -> Callable[P, R]:
        """Return a function that runs inside a block of its own."""
        self._unused = False

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            with _acting():
                return function(*args, **kwargs)

        return call

    def __del__(self) -> None:
        if self._unused:
            sentence = "magnetism() does nothing by itself: write `with magmotor.magnetism():`"
            warnings.warn_explicit(sentence, UserWarning, *self._place)


@contextmanager
def _acting() -> Iterator[None]:
    with _hook, error_raising.recorded_errors():
        yield


def is_open() -> bool:
    """Whether a block is open in this process."""
    return _hook.depth > 0


@checked
def apply_perturbation(
    model: mujoco.MjModel, data: mujoco.MjData, perturb: mujoco.MjvPerturb
) -> None:
    """Apply the mouse force of MuJoCo's viewer; call this before each step.

    The viewer writes the force to `xfrc_applied`, which `magnetism` overwrites where dipoles or
    noise act. This function applies it as a generalized force instead, to any body.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        `qfrc_applied` is set to the force, or to zero while nothing is pulled; add forces of your
        own by `+=` afterwards. `xfrc_applied` of the selected body, where the viewer's `sync` has
        written the same force, is set to zero.
    perturb : mujoco.MjvPerturb
        State of the mouse: the attribute `perturb` of the viewer's handle.

    Examples
    --------
    >>> with mm.magnetism(), mujoco.viewer.launch_passive(model, data) as viewer:  # doctest: +SKIP
    ...     while viewer.is_running():
    ...         mm.apply_perturbation(model, data, viewer.perturb)
    ...         mujoco.mj_step(model, data)
    ...         viewer.sync()
    """
    data.qfrc_applied[:] = 0.0
    body = perturb.select
    if not 0 < body < model.nbody:
        return
    wrench = data.xfrc_applied[body]
    wrench[:] = 0.0
    mujoco.mjv_applyPerturbForce(model, data, perturb)
    center, force = data.xipos[body], data.qfrc_applied
    mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], center, body, force)
    wrench[:] = 0.0


_C_TYPE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


@cache
def _control() -> ctypes.c_void_p:
    """Return MuJoCo's pointer to the control callback."""
    return ctypes.c_void_p.in_dll(library(), "mjcb_control")


def _install() -> Any:
    previous = mujoco.get_mjcb_control()
    users_callback.value = _control().value or 0
    mujoco.set_mjcb_control(None)  # one in Python cannot run while models are compiled
    try:
        address = compiled_callback().address
    finally:
        mujoco.set_mjcb_control(previous)
    if previous is None:
        mujoco.set_mjcb_control(_C_TYPE(address))
    else:
        # The bindings keep the user's function, since its C function looks it up there.
        _control().value = address
    return previous


def _restore(previous: Any) -> None:
    replaced = _control().value != compiled_callback().address
    mujoco.set_mjcb_control(previous)
    users_callback.value = 0
    if replaced:
        sentence = (
            "mujoco.set_mjcb_control replaced the callback of magnetism() inside the block, and"
            " since then nothing of magmotor has acted: set yours before the block, which calls it"
        )
        warnings.warn(sentence, stacklevel=FRAMES)


FRAMES = 6
"""Frames from the end of a block to the line of the user's code."""

_hook = Hook(_install, _restore)
