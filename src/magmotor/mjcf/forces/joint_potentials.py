"""Periodic potentials of joints, as forces written into MuJoCo's memory.

The `user` numbers (a_1, b_1, a_2, b_2, ...) of a slide or hinge joint are the Fourier coefficients
of U(q) = sum_k a_k sin kq + b_k cos kq, in J. The force (slide, at the center of mass) or torque
(hinge) -U'(q) acts along the joint's axis on the joint's body. It is external: there is no reaction
on the parent body. Hence U is the potential energy if the parent is at rest and, for a slide, the
center of mass moves by q.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

from numba import njit

from magmotor.mjcf import memory

SLIDE, HINGE = 2, 3
"""mjJNT_SLIDE and mjJNT_HINGE."""


@njit(forceinline=True)
def clear_bodies_in_potentials(m, d, offsets, applied):
    """Set the wrench of each body that has a joint with a potential to zero.

    Raises MuJoCo's error if the numbers are not pairs, or if the joint is neither slide nor hinge.
    """
    nuser = m[offsets.nuser_jnt // 8]
    joints = m[offsets.njnt // 8]
    waves = memory.numbers(m[offsets.jnt_user // 8], joints, nuser)
    kind = memory.integers(m[offsets.jnt_type // 8], joints)
    body_of = memory.integers(m[offsets.jnt_bodyid // 8], joints)
    for joint in range(joints):
        if memory.any_number(waves, joint, 0, nuser):
            applied[body_of[joint]] = 0.0
            single = nuser % 2 == 1 and waves[joint, nuser - 1] != 0.0
            if single or not (kind[joint] == SLIDE or kind[joint] == HINGE):
                starts = memory.integers(m[offsets.name_jntadr // 8], joints)
                memory.fatal_potential(joint, m[offsets.names // 8] + starts[joint])


@njit(forceinline=True)
def add_potential_wrenches(m, d, offsets, applied):
    """Add the forces of joint potentials to the wrenches of bodies; return their number."""
    nuser = m[offsets.nuser_jnt // 8]
    joints = m[offsets.njnt // 8]
    waves = memory.numbers(m[offsets.jnt_user // 8], joints, nuser)
    kind = memory.integers(m[offsets.jnt_type // 8], joints)
    body_of = memory.integers(m[offsets.jnt_bodyid // 8], joints)
    qpos_start = memory.integers(m[offsets.jnt_qposadr // 8], joints)
    qpos = memory.numbers(d[offsets.qpos // 8], 1, memory.UNBOUNDED)
    axis = memory.numbers(d[offsets.xaxis // 8], joints, 3)
    count = 0
    for joint in range(joints):
        if memory.any_number(waves, joint, 0, nuser):
            q = qpos[0, qpos_start[joint]]
            cosine, sine = math.cos(q), math.sin(q)
            # cos kq and sin kq, by the addition theorem.
            c, s = 1.0, 0.0
            force = 0.0
            for k in range(nuser // 2):
                c, s = c * cosine - s * sine, s * cosine + c * sine
                force -= (k + 1) * (waves[joint, 2 * k] * c - waves[joint, 2 * k + 1] * s)
            first = 0 if kind[joint] == SLIDE else 3
            for k in range(3):
                applied[body_of[joint], first + k] += force * axis[joint, k]
            count += 1
    return count
