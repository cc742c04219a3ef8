"""Field and potential of a uniformly charged triangle, of which the surfaces of polyhedra consist.

With the unit normal n, the outward unit normals m_i of the edges in the plane, the potentials
f_i of the edges as if they were charged, and the solid angle W, positive above the triangle,

    int (r - r')/|r - r'|^3 dS' = n W + sum_i m_i f_i,
    int 1/|r - r'| dS' = sum_i m_i.(r_i - r) f_i - n.(r - r_i) W,

where r_i is a vertex of the edge (D. R. Wilton et al., IEEE Trans. Antennas Propag. 32 (1984) 276).
W is found from the vertices (A. van Oosterom and J. Strackee, IEEE Trans. Biomed. Eng. 30 (1983)
125). Rounding errors are about 1e-15 of the charge, but grow near an edge with the inverse distance
from it, in parts of its length.

Vectors are tuples of three numbers.
"""

import math

from magmotor.numerics.deferred import twofold
from magmotor.numerics.elementary import arctangent, logarithm
from magmotor.numerics.rotations import TINY

PER_SOLID_ANGLE = 0.25 / math.pi
CUTOFF = 1e-12
"""Distance from an edge where the logarithm is cut off, in parts of the edge's length."""


@twofold(forceinline=True)
def triangle_field(point, a, b, c, charge):
    """Compute the field mu0 H of a uniformly charged triangle.

    On the triangle, this is the field above it, where the vertices turn counterclockwise.

    Parameters
    ----------
    point : tuple of float
        Point in m.
    a, b, c : tuple of float
        Vertices in m.
    charge : float
        Charge per area in T, as J.n on the face of a body with the polarization J.

    Returns
    -------
    tuple of float
        mu0 H in T.
    """
    (x, y, z), _ = triangle_integrals(point, a, b, c)
    scale = PER_SOLID_ANGLE * charge
    return scale * x, scale * y, scale * z


@twofold(forceinline=True)
def triangle_potential(point, a, b, c, charge):
    """Compute the potential phi of a uniformly charged triangle in T m; mu0 H = -grad phi.

    The parameters are those of `triangle_field`. The potential is zero at infinity.
    """
    return PER_SOLID_ANGLE * charge * triangle_integrals(point, a, b, c)[1]


@twofold(forceinline=True)
def plane_of(a, b, c):
    """Return the unit normal of a triangle, and twice its area; 0 and 0 if that is none."""
    x, y, z = _cross(_difference(b, a), _difference(c, a))
    double = math.sqrt(x * x + y * y + z * z)
    per = 1.0 / (double + TINY)
    return (x * per, y * per, z * per), double


@twofold(forceinline=True)
def solid_angle(a, b, c, height, double):
    """Return the solid angle of a triangle, with the sign of the point's height above its plane.

    The vectors a, b and c are those from the point to the vertices; twice the area is given.
    """
    p, q, r = math.sqrt(_dot(a, a)), math.sqrt(_dot(b, b)), math.sqrt(_dot(c, c))
    cosine = p * q * r + p * _dot(b, c) + q * _dot(a, c) + r * _dot(a, b)
    return 2.0 * arctangent(double * height, cosine)


@twofold(forceinline=True)
def triangle_integrals(point, a, b, c):
    """Return the integrals of (r - r')/|r - r'|^3 and 1/|r - r'|.

    What depends on the triangle only can be computed before a loop over points.
    """
    normal, double = plane_of(a, b, c)
    p, q, r = _difference(a, point), _difference(b, point), _difference(c, point)
    height = 0.0 - _dot(normal, p)
    angle = solid_angle(p, q, r, height, double)
    x, y, z = normal[0] * angle, normal[1] * angle, normal[2] * angle
    integral = -height * angle
    for first, second, start, end in ((p, q, a, b), (q, r, b, c), (r, p, c, a)):
        edge = _difference(end, start)
        length = math.sqrt(_dot(edge, edge))
        per = 1.0 / (length + TINY)
        along = edge[0] * per, edge[1] * per, edge[2] * per
        potential = _edge_potential(first, second, along, length)
        outward = _cross(along, normal)
        x += outward[0] * potential
        y += outward[1] * potential
        z += outward[2] * potential
        integral += _dot(outward, first) * potential
    return (x, y, z), integral


@twofold(forceinline=True)
def _edge_potential(a, b, along, length):
    """Return the integral of 1/r along an edge, whose direction and length are given.

    The vectors a and b are those from the point to the ends of the edge.
    """
    middle = abs(_dot(along, a) + 0.5 * length)
    ahead, behind = middle + 0.5 * length, middle - 0.5 * length
    first, second = math.sqrt(_dot(a, a)), math.sqrt(_dot(b, b))
    far, near = max(first, second), min(first, second)
    across, least = _cross(a, along), CUTOFF * length + TINY
    beyond = behind >= 0.0
    ratio = (ahead + far) * (1.0 if beyond else near - behind)
    ratio /= behind + near + least if beyond else _dot(across, across) + least * least
    return logarithm(ratio)


@twofold(forceinline=True)
def _difference(a, b):
    """Return the vector a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@twofold(forceinline=True)
def _dot(a, b):
    """Return the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@twofold(forceinline=True)
def _cross(a, b):
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
