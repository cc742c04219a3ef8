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

_A, _B, _C, _D = -0.02866, 0.02750, 0.04818, -0.10178
"""p(u, w) = A u + B u w + C u^2 + D u^2 w."""


@subroutine(forceinline=True)
def induced(target, source, along, weight, tiny, soft):
    """Return what a charge of 4 pi induces, at a target, and that of its image; see below.

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
        G - 1/R + weight/R'; the derivatives of that by r, theta and z of the target; and 1/R'.
    """
    (r, a, b), (s, u, v) = target, source
    product, square = r * s, along * along + tiny
    less, more = (r - s) * (r - s) + square, (r + s) * (r + s) + square
    c, d, p, q = a * u + b * v, b * u - a * v, a * u - b * v, b * u + a * v
    # 1/S - 1/R of the charge itself, without cancellation, and its image at the angle sum.
    gap, ends = 0.5 * ((a - u) * (a - u) + (b - v) * (b - v)), 1.0 + 2.0 * c
    turn, round_ = gap * ends * ends, (1.0 - p) * (1.0 + 2.0 * p) * (1.0 + 2.0 * p)
    one = 1.0 / (less + 9.0 * product * d * d)
    two = 1.0 / (less + 2.0 * product * turn)
    three = 1.0 / (less + soft + 9.0 * product * q * q)
    four = 1.0 / (less + soft + 2.0 * product * round_)
    near, free = math.sqrt(one), math.sqrt(two)
    far, image = math.sqrt(three), math.sqrt(four)
    direct = -2.0 * product * gap * gap * (4.0 * c + 3.5) * one * two / (near + free)
    one, two, three, four = one * near, two * free, three * far, weight * four * image
    slope = -(r - s) * (one - two - three + four)
    by_r = slope - s * (4.5 * (one * d * d - three * q * q) - two * turn + four * round_)
    by_angle = product * (
        3.0 * (three * q * p - one * d * c)
        + two * d * (4.0 * c * c - 1.0)
        - four * q * (4.0 * p * p - 1.0)
    )
    by_along = -along * (one - two - three + four)
    # The smooth rest.
    inverse = 1.0 / more
    scale, part = math.sqrt(2.0 * inverse), 4.0 * product * inverse
    x, y = c * c, p * p
    first, second = x - y, x * x - y * y
    by_part = _B * first + _D * second
    rest = scale * (_A * first + _C * second + part * by_part)
    lower = inverse * (rest + 2.0 * scale * part * by_part)
    by_r += 4.0 * s * inverse * scale * by_part - (r + s) * lower
    by_along -= along * lower
    one, two = _A + part * _B, 2.0 * (_C + part * _D)
    by_angle -= 2.0 / 3.0 * scale * (c * d * (one + two * x) - p * q * (one + two * y))
    return direct - far + weight * image + rest, by_r, by_angle, by_along, image
