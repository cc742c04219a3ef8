"""Rotations: unit quaternions, retractions, and the maps of angular momenta that belong to them.

Vectors are tuples of three numbers in the world frame; quaternions are tuples (w, x, y, z) that
rotate the body frame to the world frame. A retraction tau, here exp or the Cayley map, takes a
rotation vector W, in rad, to a rotation. The adjoint of its inverse right-trivialized tangent,
`(dtau^-1_W)* pi`, maps an angular momentum to a discrete one (Bou-Rabee and Marsden,
*Hamilton-Pontryagin integrators on Lie groups*, 2009).
"""

import math

from magmotor.numerics.deferred import subroutine
from magmotor.numerics.elementary import cosine, sine
from magmotor.numerics.simd import fused

_PER_TURN = 0.5 / math.pi
TINY = 1e-300
"""Added to squares, so that the zero vector needs no special case."""

SMALL_ANGLE = 0.25
"""Angle (rad) below which a series avoids cancellation."""


@subroutine(forceinline=True)
def dot(a, b):
    """Return the scalar product of two vectors."""
    return fused(a[0], b[0], fused(a[1], b[1], a[2] * b[2]))


@subroutine(forceinline=True)
def cross(a, b):
    """Return the cross product of two vectors."""
    return (
        fused(a[1], b[2], -a[2] * b[1]),
        fused(a[2], b[0], -a[0] * b[2]),
        fused(a[0], b[1], -a[1] * b[0]),
    )


@subroutine(forceinline=True)
def scaled(s, a):
    """Return the vector s a."""
    return s * a[0], s * a[1], s * a[2]


@subroutine(forceinline=True)
def plus(a, s, b):
    """Return the vector a + s b."""
    return fused(s, b[0], a[0]), fused(s, b[1], a[1]), fused(s, b[2], a[2])


@subroutine(forceinline=True)
def stretched(a, axis, across, along):
    """Scale the component of a vector along an axis by `along`, and the rest by `across`."""
    return plus(scaled(across, a), (along - across) * dot(a, axis), axis)


@subroutine(forceinline=True)
def mul_quat(p, q):
    """Multiply two quaternions: the rotation q followed by the rotation p."""
    return (
        fused(p[0], q[0], -fused(p[1], q[1], fused(p[2], q[2], p[3] * q[3]))),
        fused(p[0], q[1], fused(p[1], q[0], fused(p[2], q[3], -p[3] * q[2]))),
        fused(p[0], q[2], fused(p[2], q[0], fused(p[3], q[1], -p[1] * q[3]))),
        fused(p[0], q[3], fused(p[3], q[0], fused(p[1], q[2], -p[2] * q[1]))),
    )


@subroutine(forceinline=True)
def normalized(q):
    """Normalize a quaternion whose length is 1 up to rounding, without a root or a division.

    A quaternion of a very different length, as after an overflow, becomes NaN.
    """
    square = fused(q[0], q[0], dot(q[1:], q[1:]))
    scale = fused(-0.5, square, 1.5) if abs(square - 1.0) < 0.5 else math.nan
    return scale * q[0], scale * q[1], scale * q[2], scale * q[3]


@subroutine(forceinline=True)
def columns(q):
    """Return the body's three axes in the world frame, the columns of the rotation matrix."""
    w, x, y, z = q
    return (
        (
            fused(-2.0, fused(y, y, z * z), 1.0),
            2.0 * fused(x, y, w * z),
            2.0 * fused(x, z, -w * y),
        ),
        (
            2.0 * fused(x, y, -w * z),
            fused(-2.0, fused(x, x, z * z), 1.0),
            2.0 * fused(y, z, w * x),
        ),
        (
            2.0 * fused(x, z, w * y),
            2.0 * fused(y, z, -w * x),
            fused(-2.0, fused(x, x, y * y), 1.0),
        ),
    )


@subroutine(forceinline=True)
def rot_vec_quat(q, a):
    """Rotate a vector by a quaternion."""
    u = q[1], q[2], q[3]
    t = scaled(2.0, cross(u, a))
    return plus(plus(a, q[0], t), 1.0, cross(u, t))


@subroutine(forceinline=True)
def third_axis(q):
    """Return the body's z axis in the world frame."""
    return columns(q)[2]


@subroutine(forceinline=True)
def exponential(W):
    """Return exp(W), the rotation by |W| about W."""
    angle = math.sqrt(dot(W, W) + TINY)
    turns = 0.5 * _PER_TURN * angle
    scale = sine(turns) / angle
    return cosine(turns), scale * W[0], scale * W[1], scale * W[2]


@subroutine(forceinline=True)
def cayley(W):
    """Return cay(W) = (1 - W^/2)^-1 (1 + W^/2), the rotation by 2 atan(|W|/2) about W."""
    w = 1.0 / math.sqrt(fused(0.25, dot(W, W), 1.0))
    return w, 0.5 * w * W[0], 0.5 * w * W[1], 0.5 * w * W[2]


@subroutine(forceinline=True)
def exponential_momentum(W, pi):
    """(dexp^-1_W)* pi = pi + W x pi/2 + (1 - |W|/2 cot(|W|/2))/|W|^2 W x (W x pi)."""
    square = dot(W, W)
    if square < SMALL_ANGLE * SMALL_ANGLE:
        series = 1 / 30240 + square * (1 / 1209600 + square / 47900160)
        second = 1 / 12 + square * (1 / 720 + square * series)
    else:
        half = 0.5 * math.sqrt(square)
        second = (1.0 - half / math.tan(half)) / square
    first = cross(W, pi)
    return plus(plus(pi, 0.5, first), second, cross(W, first))


@subroutine(forceinline=True)
def cayley_momentum(W, pi):
    """(dcay^-1_W)* pi = pi + W x pi/2 + (W . pi) W/4."""
    return plus(plus(pi, 0.5, cross(W, pi)), 0.25 * dot(W, pi), W)


@subroutine(forceinline=True)
def place_dipoles(placed, axes, center, frame):
    """Transform the dipoles of a rigid body from its own frame to the world frame.

    `frame` (input, body frame) and `placed` (output, world frame) have rows x, y, z, mx, my, mz.
    `axes` are the `columns` of the body's orientation, and `center` is the origin of its frame.
    """
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = axes
    ox, oy, oz = center
    for j in range(frame.shape[1]):
        x, y, z = frame[0, j], frame[1, j], frame[2, j]
        placed[0, j] = fused(ax, x, fused(bx, y, fused(cx, z, ox)))
        placed[1, j] = fused(ay, x, fused(by, y, fused(cy, z, oy)))
        placed[2, j] = fused(az, x, fused(bz, y, fused(cz, z, oz)))
        x, y, z = frame[3, j], frame[4, j], frame[5, j]
        placed[3, j] = fused(ax, x, fused(bx, y, cx * z))
        placed[4, j] = fused(ay, x, fused(by, y, cy * z))
        placed[5, j] = fused(az, x, fused(bz, y, cz * z))
