"""Periodic potentials of joints, as generalized forces written into MuJoCo's memory.

The `user` numbers (a_1, b_1, a_2, b_2, ...) of a slide or hinge joint are the Fourier coefficients
of U(q) = sum_k a_k sin kq + b_k cos kq, in J, where q is in rad or m. The generalized force -U'(q)
acts on the joint, between its body and the parent.
"""

import math

from magmotor.mjcf import memory
from magmotor.numerics.deferred import subroutine


@subroutine(forceinline=True)
def add_potential_forces(m, d, offsets, generalized):
    """Add the forces of joint potentials to generalized forces (nv,); return their number.

    MuJoCo does not clear the forces on bodies that sleep, which would add up.
    """
    nuser, joints = m[offsets.nuser_jnt // 8], m[offsets.njnt // 8]
    waves = memory.numbers(m[offsets.jnt_user // 8], joints, nuser)
    body_of = memory.integers(m[offsets.jnt_bodyid // 8], joints)
    awake = memory.integers(d[offsets.body_awake // 8], memory.UNBOUNDED)
    first_dof = memory.integers(m[offsets.jnt_dofadr // 8], joints)
    qpos_start = memory.integers(m[offsets.jnt_qposadr // 8], joints)
    qpos = memory.numbers(d[offsets.qpos // 8], 1, memory.UNBOUNDED)
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
            if awake[body_of[joint]] != memory.ASLEEP:
                generalized[first_dof[joint]] += force
            count += 1
    return count
