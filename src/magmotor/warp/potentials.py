"""Periodic potentials of joints; see `magmotor.mjcf.forces.joint_potentials`."""

from typing import Any

import mujoco
import numpy as np
import warp as wp

from magmotor.warp.per_world import PerWorld

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _add_potential_forces(
    joint: wp.array[int],
    wave: wp.array3d[float],
    jnt_qposadr: wp.array[int],
    jnt_dofadr: wp.array[int],
    qpos: wp.array2d[float],
    generalized: wp.array2d[float],
):
    world, k = wp.tid()
    row = world % wave.shape[0]
    q = qpos[world, jnt_qposadr[joint[k]]]
    cosine = wp.cos(q)
    sine = wp.sin(q)
    # cos kq and sin kq, by the addition theorem.
    c = float(1.0)
    s = float(0.0)
    force = float(0.0)
    for i in range(wave.shape[2] // 2):
        previous = c
        c = c * cosine - s * sine
        s = s * cosine + previous * sine
        force -= float(i + 1) * (wave[row, k, 2 * i] * c - wave[row, k, 2 * i + 1] * s)
    generalized[world, jnt_dofadr[joint[k]]] += force


class Potentials:
    """The potentials of a model.

    Attributes
    ----------
    joints : ndarray of int, shape (n,)
    waves : wp.array, shape (1 or nworld, n, numbers)
        The coefficients a_1, b_1, a_2, b_2, ... of each joint in J, which may be set.
    """

    waves = PerWorld()

    def __init__(self, model: mujoco.MjModel):
        self.joints = np.flatnonzero(model.jnt_user.any(axis=1)).astype(np.int32)
        self.waves = wp.array(model.jnt_user[self.joints][None], dtype=float, ndim=3)
        self._joint = wp.array(self.joints, dtype=int)

    def add_forces(self, m: Any, d: Any) -> None:
        """Add the forces to `qfrc_passive`."""
        wp.launch(
            _add_potential_forces,
            dim=(d.nworld, len(self.joints)),
            inputs=[self._joint, self.waves, m.jnt_qposadr, m.jnt_dofadr, d.qpos],
            outputs=[d.qfrc_passive],
        )
