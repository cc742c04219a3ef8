"""The field that a charge induces near the convex edge of ideal iron: a wedge of 90 degrees.

A charge has the distance r from the edge, the angle theta from one face, from 0 to 3 pi/2, and a
place along the edge. With n = 2/3 and cosh eta = (r^2 + r'^2 + (z - z')^2)/(2 r r'), the potential
of one of 4 pi at another is that of H. M. Macdonald (Proc. Lond. Math. Soc. 14 (1915) 410),

    G = g(theta - theta') - g(theta + theta'),
    g(psi) = (2 r r')^(-1/2)/pi int_eta^inf n sinh(n x)/(cosh(n x) - cos(n psi))
             dx/(cosh(x) - cosh(eta))^(1/2).

It is singular as 1/S, S^2 = (r - r')^2 + (z - z')^2 + 9 r r' sin^2(psi/3), and the rest is smooth:

    g(psi) = 1/S + 2^(1/2)/T (function of v + p(cos^2(psi/3), v^2)),

where T^2 = (r + r')^2 + (z - z')^2 and v^2 = 4 r r'/T^2. The polynomial p is a fit by least squares
for all angles and v, whose error is 0.015 where 1/S counts 0.5 to infinity.
"""

import math

from magmotor.numerics.deferred import subroutine
from magmotor.numerics.simd import square_root

_A, _B, _C, _D = -0.02866, 0.02750, 0.04818, -0.10178
"""p(u, w) = A u + B u w + C u^2 + D u^2 w."""


@subroutine(forceinline=True)
def induced(target, source, along, weight, tiny, soft):
    """Return what a charge of 4 pi induces, at a target, and that of its image; see below.

    All but `tiny` and `soft` may be vectors of eight.

    Parameters
    ----------
    target, source : tuple of float
        The distance from the edge, and the cosine and the sine of a third of the angle.
    along : float
        z - z'.
    weight : float
        A multiple of 1/R' is added, where R' is the distance from the image in the face.
    tiny, soft : float
        Squares of lengths; nearer than these, nothing diverges: 1/R, and images.

    Returns
    -------
    tuple of float
        G - 1/R + weight/R'; the derivatives of that by r, r', theta - theta', theta + theta' and
        z - z'; and 1/R'.
    """
    (r, a, b), (s, u, v) = target, source
    product, less, more = r * s, r - s, r + s
    square, twice = along * along + tiny, 2.0 * product
    c, d, p, q = a * u + b * v, b * u - a * v, a * u - b * v, b * u + a * v
    gap, ends = 0.5 * ((a - u) * (a - u) + (b - v) * (b - v)), 1.0 + 2.0 * c
    turn, round_ = gap * ends * ends, (1.0 - p) * (1.0 + 2.0 * p) * (1.0 + 2.0 * p)
    # The distances S and R of the charge itself, and S and R' of its image at the angle sum; and T.
    close = less * less + square
    softer = close + soft
    near, free = square_root(close + 9.0 * product * d * d), square_root(close + twice * turn)
    far, image = square_root(softer + 9.0 * product * q * q), square_root(softer + twice * round_)
    large, ahead = square_root(more * more + square), near + free
    # Their inverses, by one division.
    one, two, three = near * free, far * image, large * ahead
    inverse = 1.0 / (one * two * three)
    one, two, three = inverse * two * three, inverse * one * three, inverse * one * two
    # 1/R - 1/S without cancellation.
    direct = twice * gap * gap * (4.0 * c + 3.5) * one * three * large
    near, free, far, image, large = one * free, one * near, two * image, two * far, three * ahead
    one, two, three = near * near * near, free * free * free, far * far * far
    four = weight * image * image * image
    force = two + three - one - four
    swing = 4.5 * (one * d * d - three * q * q) - two * turn + four * round_
    # The smooth rest.
    scale = math.sqrt(2.0) * large
    inverse, x, y = large * large, c * c, p * p
    part, first, second = 4.0 * product * inverse, x - y, x * x - y * y
    by_part = _B * first + _D * second
    rest = scale * (_A * first + _C * second + part * by_part)
    lower = inverse * (rest + 2.0 * scale * part * by_part)
    swing = swing - 4.0 * inverse * scale * by_part
    linear, square, scale = _A + part * _B, 2.0 * (_C + part * _D), 2.0 / 3.0 * scale
    by_difference = product * (two * (4.0 * x - 1.0) - 3.0 * one * c)
    by_sum = product * (3.0 * three * p - four * (4.0 * y - 1.0))
    return (
        rest - direct - far + weight * image,
        less * force - s * swing - more * lower,
        -1.0 * less * force - r * swing - more * lower,
        d * (by_difference - scale * c * (linear + square * x)),
        q * (by_sum + scale * p * (linear + square * y)),
        along * (force - lower),
        image,
    )
