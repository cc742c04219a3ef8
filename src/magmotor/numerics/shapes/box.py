"""Field and potential of a uniformly polarized box, centered at the origin of its frame.

The polarization J puts the charges J.n on the faces. With the demagnetizing tensor N of the point,
mu0 H = -N J: its diagonal has the solid angles of the faces, and the other elements have the
potentials of the edges as if they were charged (A. J. Newell, W. Williams and D. J. Dunlop,
J. Geophys. Res. 98 (1993) 9551). All corners are combined before the logarithm or the arctangent
is taken.

By symmetry, the point is reflected into the octant of positive coordinates. There, the distances
from the lower faces are positive, those from the upper faces are negative inside. Rounding errors
are about 1e-15 |J| at any distance, so that the relative errors grow with its third power.
"""

import math

from magmotor.numerics.deferred import twofold
from magmotor.numerics.elementary import arctangent, logarithm

PER_SOLID_ANGLE = 0.25 / math.pi
CUTOFF = 1e-12
"""Distance at which a point in the plane of a face is put outside, in parts of the size."""


@twofold(forceinline=True)
def box_field(x, y, z, a, b, c, jx, jy, jz):
    """Compute the field mu0 H of a uniformly polarized box, outside or inside.

    On a face, this is the field just outside. Components of J that are zero cost little.

    Parameters
    ----------
    x, y, z : float
        Point in the frame of the box, in m.
    a, b, c : float
        Half the lengths of the edges along x, y and z, in m.
    jx, jy, jz : float
        Polarization J in T.

    Returns
    -------
    hx, hy, hz : float
        mu0 H in T; inside, B = mu0 H + J.
    """
    up, um, vp, vm, wp, wm = _distances(x, y, z, a, b, c)
    ppp, ppm, pmp, pmm = _lengths(up, vp, vm, wp, wm)
    mpp, mpm, mmp, mmm = _lengths(um, vp, vm, wp, wm)
    hx = hy = hz = 0.0
    if jx != 0.0 or jy != 0.0:
        n = math.copysign(1.0, x) * math.copysign(1.0, y)
        n *= _edges(up, um, vp, vm, wp, wm, ppp, ppm, pmp, pmm, mpp, mpm, mmp, mmm)
        hx += n * jy
        hy += n * jx
    if jx != 0.0 or jz != 0.0:
        n = math.copysign(1.0, x) * math.copysign(1.0, z)
        n *= _edges(up, um, wp, wm, vp, vm, ppp, pmp, ppm, pmm, mpp, mmp, mpm, mmm)
        hx += n * jz
        hz += n * jx
    if jy != 0.0 or jz != 0.0:
        n = math.copysign(1.0, y) * math.copysign(1.0, z)
        n *= _edges(vp, vm, wp, wm, up, um, ppp, mpp, ppm, mpm, pmp, mmp, pmm, mmm)
        hy += n * jz
        hz += n * jy
    if jx != 0.0:
        n = _solid_angle(um, vp, vm, wp, wm, mpp, mpm, mmp, mmm)
        hx += jx * (n - _solid_angle(up, vp, vm, wp, wm, ppp, ppm, pmp, pmm))
    if jy != 0.0:
        n = _solid_angle(vm, wp, wm, up, um, pmp, mmp, pmm, mmm)
        hy += jy * (n - _solid_angle(vp, wp, wm, up, um, ppp, mpp, ppm, mpm))
    if jz != 0.0:
        n = _solid_angle(wm, up, um, vp, vm, ppm, pmm, mpm, mmm)
        hz += jz * (n - _solid_angle(wp, up, um, vp, vm, ppp, pmp, mpp, mmp))
    return PER_SOLID_ANGLE * hx, PER_SOLID_ANGLE * hy, PER_SOLID_ANGLE * hz


@twofold(forceinline=True)
def box_potential(x, y, z, a, b, c, jx, jy, jz):
    """Compute the potential phi of a uniformly polarized box in T m, where mu0 H = -grad phi.

    The parameters are those of `box_field`. The potential is continuous, and zero at infinity.
    """
    up, um, vp, vm, wp, wm = _distances(x, y, z, a, b, c)
    phi = 0.0
    if jx != 0.0:
        difference = _rectangle(um, vp, vm, wp, wm) - _rectangle(up, vp, vm, wp, wm)
        phi += math.copysign(1.0, x) * jx * difference
    if jy != 0.0:
        difference = _rectangle(vm, wp, wm, up, um) - _rectangle(vp, wp, wm, up, um)
        phi += math.copysign(1.0, y) * jy * difference
    if jz != 0.0:
        difference = _rectangle(wm, up, um, vp, vm) - _rectangle(wp, up, um, vp, vm)
        phi += math.copysign(1.0, z) * jz * difference
    return PER_SOLID_ANGLE * phi


@twofold(forceinline=True)
def box_continued_field(x, y, z, a, b, c, jx, jy, jz):
    """Compute `box_field`, but continue the field outside to the inside, from the nearest face."""
    hx, hy, hz = box_field(x, y, z, a, b, c, jx, jy, jz)
    face, _ = _nearest_face(x, y, z, a, b, c)
    return (
        hx + (jx if face == 0 else 0.0),
        hy + (jy if face == 1 else 0.0),
        hz + (jz if face == 2 else 0.0),
    )


@twofold(forceinline=True)
def box_continued_potential(x, y, z, a, b, c, jx, jy, jz):
    """Compute the potential of `box_continued_field`."""
    face, height = _nearest_face(x, y, z, a, b, c)
    normal = (
        (math.copysign(jx, jx * x) if face == 0 else 0.0)
        + (math.copysign(jy, jy * y) if face == 1 else 0.0)
        + (math.copysign(jz, jz * z) if face == 2 else 0.0)
    )
    return box_potential(x, y, z, a, b, c, jx, jy, jz) - normal * height


@twofold(forceinline=True)
def box_contains(x, y, z, a, b, c):
    """Return whether a point is inside, not on a face."""
    return abs(x) < a and abs(y) < b and abs(z) < c


@twofold(forceinline=True)
def _nearest_face(x, y, z, a, b, c):
    """Return the normal axis of the nearest face, -1 outside, and the height above it (< 0)."""
    u, v, w = abs(x) - a, abs(y) - b, abs(z) - c
    height = max(u, v, w)
    face = 0 if u == height else (1 if v == height else 2)
    return face if height < 0.0 else -1, height


@twofold(forceinline=True)
def _distances(x, y, z, a, b, c):
    """Return the distances from the lower and upper faces along each axis; none is zero."""
    u, v, w = abs(x) - a, abs(y) - b, abs(z) - c
    least = CUTOFF * (a + b + c)
    return (
        abs(x) + a,
        u if u != 0.0 else least,
        abs(y) + b,
        v if v != 0.0 else least,
        abs(z) + c,
        w if w != 0.0 else least,
    )


@twofold(forceinline=True)
def _lengths(u, vp, vm, wp, wm):
    """Return the distances from four corners: ++, +-, -+ and --."""
    upper, lower = u * u + vp * vp, u * u + vm * vm
    return (
        math.sqrt(upper + wp * wp),
        math.sqrt(upper + wm * wm),
        math.sqrt(lower + wp * wp),
        math.sqrt(lower + wm * wm),
    )


@twofold(forceinline=True)
def _edge(u, v, wp, wm, rp, rm):
    """Return (wp + rp)/(wm + rm), whose logarithm is an edge's potential, as a fraction."""
    ahead = wm > 0.0
    above = (wp + rp) * (1.0 if ahead else rm - wm)
    return above, wm + rm if ahead else u * u + v * v


@twofold(forceinline=True)
def _edges(up, um, vp, vm, wp, wm, ppp, ppm, pmp, pmm, mpp, mpm, mmp, mmm):
    """Return the sum of the potentials of the four edges along w, with the signs of uv."""
    a, b = _edge(up, vp, wp, wm, ppp, ppm)
    c, d = _edge(up, vm, wp, wm, pmp, pmm)
    e, f = _edge(um, vp, wp, wm, mpp, mpm)
    g, h = _edge(um, vm, wp, wm, mmp, mmm)
    return logarithm((a * d * f * g) / (b * c * e * h))


@twofold(forceinline=True)
def _solid_angle(w, up, um, vp, vm, pp, pm, mp, mm):
    """Return the solid angle of a rectangle at distance w, with the sign of w.

    It is the argument of the product of w r + i u v, or its conjugate, over the corners. Above the
    rectangle, it is between 0 and 2 pi, elsewhere between 0 and pi, apart from rounding errors.
    """
    h = abs(w)
    x, y = _product(h * pp, up * vp, h * mm, um * vm)
    p, q = _product(h * pm, -up * vm, h * mp, -um * vp)
    x, y = _product(x, y, p, q)
    above = um < 0.0 and vm < 0.0
    turn = 2.0 * math.pi if y < 0.0 and (x < 0.0 or above) else 0.0
    return math.copysign(1.0, w) * (arctangent(y, x) + turn)


@twofold(forceinline=True)
def _product(a, b, c, d):
    """Return (a + i b)(c + i d)."""
    return a * c - b * d, a * d + b * c


@twofold(forceinline=True)
def _rectangle(w, up, um, vp, vm):
    """Return the integral of 1/r over a rectangle at distance w."""
    pp, pm, mp, mm = _lengths(w, up, um, vp, vm)
    a, b = _edge(w, up, vp, vm, pp, pm)
    c, d = _edge(w, um, vp, vm, mp, mm)
    e, f = _edge(w, vp, up, um, pp, mp)
    g, h = _edge(w, vm, up, um, pm, mm)
    total = up * logarithm(a / b) - um * logarithm(c / d)
    total += vp * logarithm(e / f) - vm * logarithm(g / h)
    return total - w * _solid_angle(w, up, um, vp, vm, pp, pm, mp, mm)
