"""A block in which dipoles, noise and potentials act on every model, by a compiled callback.

First what users call; then how the callback is installed; then the callback itself, which reads
what a model declares.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import ctypes
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import mujoco
from numba import njit, types

from magmotor.common.arguments import checked
from magmotor.mjcf import layout, memory
from magmotor.mjcf.forces.brownian import add_brownian_wrenches, clear_driven_bodies, step_number
from magmotor.mjcf.forces.dipole_sites import (
    NO_DIPOLES,
    NONE_MOVES,
    ONE_RIGID_BODY,
    SWITCHED_OFF,
    why_inert,
)
from magmotor.mjcf.forces.magnets import set_magnetic_wrenches
from magmotor.mjcf.forces.potential import add_potential_wrenches, clear_bodies_in_potentials
from magmotor.mjcf.hooks import Hook
from magmotor.numerics.compiled import compiled_once


@contextmanager
def magnetism() -> Iterator[None]:
    """Make magnetism, Brownian wrenches and periodic potentials act inside a `with` block.

    They act on every MuJoCo model that declares them in its MJCF:

    - a dipole is a site with `user="MOMENT"` in A m^2, along its z axis; dipoles of one rigid body
      (a body and those on it without a joint, whatever an `<equality>` welds) do not act on one
      another, and those of two bodies that are the elements of a `<custom>` tuple named
      `coupling...` act `prm` times as strongly (see Notes);
    - Brownian wrenches are rows of six in a body's `user`: force x y z, torque x y z of each row
      in the world frame at the center of mass, times its own white noise, in N sqrt(s) and
      N m sqrt(s). `mjData.userdata` holds, as far as the model has `nuserdata`, the seed, the
      replica's number, factor and level of a `BrownianPath`, and the path's step at time 0; see
      Notes on rollouts and resets;
    - a periodic potential sum_k a_k sin kq + b_k cos kq, in J, of a slide or hinge joint is
      `user="a_1 b_1 a_2 b_2 ..."`; its force acts from outside on the joint's body, at the center
      of mass along the axis.

    They give the wrench `xfrc_applied` of the bodies that have any of these, which is overwritten.

    The callback is installed as `mjcb_control`, for all models and threads of the process, and
    what was installed before is put back at the end. Blocks may be nested and may overlap in
    several threads. It works with `mj_step`, `mj_forward`, `mujoco.rollout`,
    `mujoco.batch.Batch` and the viewer, without the GIL. There is but one such callback: what was
    installed before does not run inside the block, and what `mujoco.set_mjcb_control` installs
    there replaces ours, in silence.

    After the block the last forces are still in `xfrc_applied`, and MuJoCo goes on applying them:
    set it to zero. The viewer's `sync` does so after each step.

    Warns
    -----
    UserWarning
        Once a block, when a model is stepped that has none of these, or dipoles of which none acts
        on another. It says why.

    Raises
    ------
    LayoutError
        This version of MuJoCo keeps its data in other places than it declares.
    mujoco.FatalError
        While stepping, with names: two dipoles of different bodies coincide; a site's numbers are
        not one finite moment; a coupling's elements are not two bodies with equal `prm`; a body's
        numbers are no rows of six, or a joint's no pairs, or it is neither slide nor hinge; a
        number in `userdata` chooses no path. MuJoCo pads shorter lists to the longest in the model
        with zeros, which are no error. On the threads of rollouts and batches MuJoCo prints the
        error and ends the process; one `mj_forward` before them raises it.

    Notes
    -----
    Forces follow physics of point dipoles: F = grad(m.B), torque m x B. A coupling multiplies both
    between the two bodies it names (`world` is one, too), not between those rigidly on them; 0
    turns them off, which is what MuJoCo takes for a missing `prm`, and the factors of several
    couplings of one pair multiply:

        <custom>
          <tuple name="coupling of ball and ring">
            <element objtype="body" objname="ball" prm="2"/>
            <element objtype="body" objname="ring" prm="2"/>
          </tuple>
        </custom>

    A step's noise is constant over the stages of RK4; `magmotor.mjcf.forces.brownian` tells
    how steps are counted. The count is time over timestep: noise repeats, or a part of it is left
    out, where the timestep changes midway.

    `mj_resetData` sets `userdata` to zero, and with it the seed. The state from which a rollout
    starts has none: give each trajectory its own as a control, (seed, replica) with
    `control_spec=mjSTATE_USERDATA`, or all that a thread runs have the noise of its `mjData`. A
    `Batch` has an array `userdata`.

    With noise alpha along a friction c of rate lambda = c/m, kT = alpha^2/(2c) at short steps. By
    `mj_step` it is kT/(1 + lambda h/2) where MuJoCo damps implicitly: joints in Euler and
    implicitfast, tendons in implicitfast. It is kT/(1 - lambda h/2), for lambda h < 2, in viscous
    contacts, and of tendons in Euler; and about kT (1 - (lambda h)^2/12), for lambda h < 2.785,
    with RK4. `Baoab` has kT at any step.

    Actuation must not be disabled by flag, since MuJoCo then skips the
    callback.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> model = mujoco.MjModel.from_xml_string('''
    ... <mujoco>
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
    with _hook:
        yield


@checked
def apply_perturbation(
    model: mujoco.MjModel, data: mujoco.MjData, perturb: mujoco.MjvPerturb
) -> None:
    """Apply the force of the mouse in MuJoCo's viewer, before a step.

    The viewer writes it to `xfrc_applied`, which `magnetism` overwrites where dipoles, noise or
    potentials act. Here it is a generalized force, on any body.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        Its `qfrc_applied` becomes the force, zero while nothing is pulled: call this first, then
        add forces of your own by `+=`. The `xfrc_applied` of
        the selected body, where the viewer's `sync` has left the same force, becomes zero.
    perturb : mujoco.MjvPerturb
        What the mouse does: the attribute `perturb` of the viewer's handle.

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
    place, force = data.xipos[body], data.qfrc_applied
    mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], place, body, force)
    wrench[:] = 0.0


_C_TYPE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


def _install() -> Any:
    function = _C_TYPE(compiled_callback().address or 0)
    _reported.value = 0
    previous = mujoco.get_mjcb_control()
    mujoco.set_mjcb_control(function)
    return previous


_hook = Hook(_install, mujoco.set_mjcb_control)


@cache
def compiled_callback():
    """The callback for the MuJoCo that is running, compiled once a process at the most."""
    memory.bind_function("magmotor_report_inert", _report)
    memory.bind_variable("magmotor_inert_reported", _reported)
    return _callback(layout.current())


@cache
def compiled_plugin():
    """The plugin's function for the MuJoCo that is running."""
    memory.bind_function("mj_applyFT", memory.library().mj_applyFT)
    compiled_callback()
    return _plugin(layout.current())


_PLUGIN_SIGNATURE = types.void(types.int64, types.int64, types.int32, types.int32)
_word = types.int64
_apply_wrench = types.ExternalFunction(
    "mj_applyFT", types.void(_word, _word, _word, _word, _word, types.int32, _word)
)


@compiled_once(_PLUGIN_SIGNATURE, error_model="numpy")
def _plugin(checksum: int, offsets: layout.Layout):
    def compute(model, data, instance, capability):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        slots = memory.integers(m[offsets.plugin // 8], memory.UNBOUNDED)
        for other in range(instance):
            if slots[other] == slots[instance]:
                return
        step = step_number(model, data, offsets)  # which our own use of the stack would change
        bodies = m[offsets.nbody // 8]
        stack = d.ctypes.data
        memory.mark_stack(stack)
        room = memory.allocate(stack, 48 * bodies, 8)
        applied = memory.numbers(room, bodies, 6)
        for body in range(bodies):
            for k in range(6):
                applied[body, k] = 0.0
        apply_forces(model, data, offsets, applied)
        if m[offsets.nuser_body // 8] > 0:
            add_brownian_wrenches(model, data, offsets, step, applied)
        for body in range(1, bodies):
            if memory.any_number(applied, body, 0, 6):
                wrench = room + 48 * body
                center = d[offsets.xipos // 8] + 24 * body
                _apply_wrench(
                    model, data, wrench, wrench + 24, center, body, d[offsets.qfrc_passive // 8]
                )
        memory.free_stack(stack)

    return compute


_SIGNATURE = types.void(types.int64, types.int64)


@compiled_once(_SIGNATURE, error_model="numpy")
def _callback(checksum: int, offsets: layout.Layout):
    """The callback for one layout of the structs.

    The offsets are a closure cell, and plain numbers: a compiled function among the cells would be
    a new key of Numba's cache in every process.
    """

    def callback(model, data):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        applied = memory.numbers(d[offsets.xfrc_applied // 8], memory.UNBOUNDED, 6)
        acting = apply_forces(model, data, offsets, applied)
        if m[offsets.nuser_body // 8] > 0:
            step = step_number(model, data, offsets)
            acting += add_brownian_wrenches(model, data, offsets, step, applied)
        if acting == 0 and memory.inert_reported() == 0:
            memory.report_inert(why_inert(m, offsets))

    return callback


@njit(forceinline=True)
def apply_forces(model, data, offsets, applied):
    """Overwrite the wrenches of bodies with what acts on them but noise; return how much acts.

    `model` and `data` are the addresses of mjModel and mjData, `offsets` their layout, `applied`
    (nbody, 6) the wrenches.
    """
    m = memory.words(model, memory.UNBOUNDED)
    d = memory.words(data, memory.UNBOUNDED)
    in_potentials = m[offsets.nuser_jnt // 8] > 0
    if m[offsets.nuser_body // 8] > 0:
        clear_driven_bodies(m, d, offsets, applied)
    if in_potentials:
        clear_bodies_in_potentials(m, d, offsets, applied)
    acting = set_magnetic_wrenches(m, d, offsets, applied)
    if in_potentials:
        acting += add_potential_wrenches(m, d, offsets, applied)
    return acting


_reported = ctypes.c_int64(0)
"""Whether a model on which nothing acts was reported since the callback was installed."""

_REASONS = {
    NO_DIPOLES: 'it has no dipole sites (a site with user="MOMENT" in A m^2, along its z axis)',
    ONE_RIGID_BODY: "its dipole sites are all on one rigid body, and there must be another",
    NONE_MOVES: "none of the bodies with dipole sites can move: one must have a joint",
    SWITCHED_OFF: "its couplings switch all magnetism off (prm 0, which a missing prm means, too)",
}


@ctypes.CFUNCTYPE(None, ctypes.c_int64)
def _report(reason):
    _reported.value = 1
    warnings.warn(
        f"nothing acts on this model: {_REASONS[reason]}; nor has it Brownian wrenches (a body with"
        " rows of six user numbers) or periodic potentials (a joint with pairs of them)",
        stacklevel=2,
    )
