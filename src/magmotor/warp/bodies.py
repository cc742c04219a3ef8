"""Wrenches on bodies, as generalized forces.

A wrench is a force and a torque about the center of mass of a body. Each of them has a place of its
own, so that no two threads write to the same one, and all sums have the same order in each run. The
places are sorted by body. MuJoCo numbers the bodies of a subtree one after the other, so that those
which a degree of freedom moves are a range of places.
"""

from typing import Any

import mujoco
import numpy as np
import warp as wp

from magmotor.common.arrays import Integers

wp.set_module_options({"enable_backward": False})


@wp.func
def wrench_on_dipole(
    place: wp.vec3, moment: wp.vec3, force: wp.vec3, flux: wp.vec3, center: wp.vec3
):
    """Return the wrench of a force and a flux density on a dipole, about a center."""
    return wp.spatial_vector(force, wp.cross(moment, flux) + wp.cross(place - center, force))


@wp.kernel
def _add_generalized_forces(
    first: wp.array[int],
    end: wp.array[int],
    body: wp.array[int],
    wrench: wp.array2d[wp.spatial_vector],
    body_rootid: wp.array[int],
    dof_bodyid: wp.array[int],
    xipos: wp.array2d[wp.vec3],
    subtree_com: wp.array2d[wp.vec3],
    cdof: wp.array2d[wp.spatial_vector],
    generalized: wp.array2d[float],
):
    world, dof = wp.tid()
    if first[dof] == end[dof]:
        return
    axis = wp.spatial_top(cdof[world, dof])
    linear = wp.spatial_bottom(cdof[world, dof])
    origin = subtree_com[world, body_rootid[dof_bodyid[dof]]]
    total = float(0.0)
    for k in range(first[dof], end[dof]):
        velocity = linear + wp.cross(axis, xipos[world, body[k]] - origin)
        total += wp.dot(velocity, wp.spatial_top(wrench[world, k]))
        total += wp.dot(axis, wp.spatial_bottom(wrench[world, k]))
    generalized[world, dof] += total


class Bodies:
    """Where wrenches act.

    Parameters
    ----------
    model : mujoco.MjModel
    acted : ndarray of int, shape (n,)
        The body of each wrench, in any order.

    Attributes
    ----------
    place : ndarray of int, shape (n,)
        The place of each wrench.
    body : wp.array, shape (n,)
        The body of each place.
    """

    def __init__(self, model: mujoco.MjModel, acted: Integers):
        order = np.argsort(acted, kind="stable")
        self.place = np.argsort(order).astype(np.int32)
        bodies, owner = acted[order], model.dof_bodyid
        subtree = np.ones(model.nbody, int)
        for body in range(model.nbody - 1, 0, -1):
            subtree[model.body_parentid[body]] += subtree[body]
        self.body = wp.array(bodies, dtype=int)
        self._first = wp.array(np.searchsorted(bodies, owner), dtype=int)
        self._end = wp.array(np.searchsorted(bodies, owner + subtree[owner]), dtype=int)

    def apply(self, m: Any, d: Any, wrench: Any) -> None:
        """Add the generalized forces of wrenches, by place, to `qfrc_passive`."""
        wp.launch(
            _add_generalized_forces,
            dim=(d.nworld, m.nv),
            inputs=[
                self._first, self._end, self.body, wrench, m.body_rootid, m.dof_bodyid, d.xipos,
                d.subtree_com, d.cdof,
            ],
            outputs=[d.qfrc_passive],
        )  # fmt: skip
