"""The front door to the compiled callback: a block in which it acts on every model."""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from magmotor.engines.mujoco.callback import compiled_callback, report_again

_C_TYPE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)

_lock = threading.Lock()
_depth = 0
_previous = None


@contextmanager
def magnetism() -> Iterator[None]:
    """Make magnetism, Brownian wrenches and periodic potentials act inside a `with` block.

    They act on every MuJoCo model that declares them in its MJCF:

    - a dipole is a site with `user="MOMENT"` in A m^2, along its z axis; dipoles of bodies welded
      together do not act on one another, and those of two bodies that are the elements of a
      `<custom>` tuple named `coupling...` act `prm` times as strongly (see Notes);
    - Brownian wrenches are rows of six in a body's `user`: force x y z, torque x y z of each row
      in the world frame at the centre of mass, times its own white noise, in N sqrt(s) and
      N m sqrt(s). `mjData.userdata` holds, as far as the model has `nuserdata`, the seed, the
      replica's number, factor and level of a `BrownianPath`, and the path's step at time 0;
    - a periodic potential sum_k a_k sin kq + b_k cos kq, in J, of a slide or hinge joint is
      `user="a_1 b_1 a_2 b_2 ..."`; its force acts from outside on the joint's body, at the centre
      of mass along the axis.

    They give the wrench `xfrc_applied` of the bodies that have any of these, which is overwritten.

    The callback is installed as `mjcb_control`, for all models and threads of the process, and
    what was installed before is put back at the end. Blocks may be nested and may overlap in
    several threads. It works with `mj_step`, `mj_forward`, `mujoco.rollout`,
    `mujoco.batch.Batch` and the viewer, without the GIL.

    Warns
    -----
    UserWarning
        Once a block, when a model is stepped that has none of these.

    Raises
    ------
    LayoutError
        This version of MuJoCo keeps its data in other places than it declares.
    mujoco.FatalError
        While stepping, with names: two dipoles of different bodies coincide; a coupling's elements
        are not two bodies with equal `prm`; a body's numbers are no rows of six, or a joint's no
        pairs, or it is neither slide nor hinge. MuJoCo pads shorter lists to the longest in the
        model with zeros, which are no error.

    Notes
    -----
    Forces follow physics of point dipoles: F = grad(m.B), torque m x B. A coupling multiplies both
    between the two bodies it names (`world` is one, too), not between those welded to them; 0 turns
    them off, and the factors of several couplings of one pair multiply::

        <custom>
          <tuple name="coupling of ball and ring">
            <element objtype="body" objname="ball" prm="2"/>
            <element objtype="body" objname="ring" prm="2"/>
          </tuple>
        </custom>

    A step's noise is constant over the stages of RK4; `magmotor.engines.mujoco.step_number` tells
    how steps are counted. Actuation must not be disabled by flag, since MuJoCo then skips the
    callback.
    """
    global _depth, _previous
    with _lock:
        if _depth == 0:
            function = _C_TYPE(compiled_callback().address or 0)
            report_again()
            _previous = mujoco.get_mjcb_control()
            mujoco.set_mjcb_control(function)
        _depth += 1
    try:
        yield
    finally:
        with _lock:
            _depth -= 1
            if _depth == 0:
                mujoco.set_mjcb_control(_previous)
                _previous = None
