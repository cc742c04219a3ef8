"""The flux density of an applied field at a point, and its gradient.

The numbers of a field and their order are those of `magmotor.mjcf.declarations.fields`, and the
interpolation is that of `magmotor.numerics.cubic_convolution`, in single precision.
"""

import warp as wp

from magmotor.mjcf.declarations import custom
from magmotor.mjcf.declarations import fields as declarations

wp.set_module_options({"enable_backward": False})

BODY, SITE = wp.constant(custom.BODY), wp.constant(custom.SITE)
UNIFORM, GRADIENT = wp.constant(declarations.UNIFORM), wp.constant(declarations.GRADIENT)
HEADER = wp.constant(declarations.HEADER)

ROUNDED = wp.constant(1e-4)
"""Distance beyond the outermost nodes, in spacings, that counts as a rounding error of a place: it
is that of single precision for about a thousand nodes along an axis."""


@wp.func
def _weights(place: float, count: int):
    """Return the first of four nodes, their weights, and the derivatives of the weights."""
    cell = int(0)
    t = wp.NAN
    if place >= -ROUNDED and place <= float(count - 1) + ROUNDED:
        cell = wp.clamp(int(place), 0, count - 2)
        t = place - float(cell)
    a = t * (t * (1.0 - 0.5 * t) - 0.5)
    b = 1.0 + t * t * (1.5 * t - 2.5)
    c = t * (0.5 + t * (2.0 - 1.5 * t))
    d = t * t * (0.5 * t - 0.5)
    da = t * (2.0 - 1.5 * t) - 0.5
    db = t * (4.5 * t - 5.0)
    dc = 0.5 + t * (4.0 - 4.5 * t)
    dd = t * (1.5 * t - 1.0)
    first = cell - 1
    weights = wp.vec4(a, b, c, d)
    slopes = wp.vec4(da, db, dc, dd)
    # Beyond the grid, a parabola through the three outermost nodes continues the values.
    if cell == 0:
        first = int(0)
        weights = wp.vec4(b + 3.0 * a, c - 3.0 * a, d + a, 0.0 * t)
        slopes = wp.vec4(db + 3.0 * da, dc - 3.0 * da, dd + da, 0.0)
    elif cell == count - 2:
        first = count - 4
        weights = wp.vec4(0.0 * t, a + d, b - 3.0 * d, c + 3.0 * d)
        slopes = wp.vec4(0.0, da + dd, db - 3.0 * dd, dc + 3.0 * dd)
    return first, weights, slopes


@wp.func
def _tabulated(numbers: wp.array2d[float], row: int, x: wp.vec3):
    """Return a field from a table and its gradient, in its own frame; NaN outside."""
    ny = int(numbers[row, 1])
    nz = int(numbers[row, 2])
    lower = wp.vec3(numbers[row, 3], numbers[row, 4], numbers[row, 5])
    spacing = wp.vec3(numbers[row, 6], numbers[row, 7], numbers[row, 8])
    at = wp.cw_div(x - lower, spacing)
    i, u, du = _weights(at[0], int(numbers[row, 0]))
    j, v, dv = _weights(at[1], ny)
    k, w, dw = _weights(at[2], nz)
    flux = wp.vec3(0.0)
    along_x = wp.vec3(0.0)
    along_y = wp.vec3(0.0)
    along_z = wp.vec3(0.0)
    for a in range(4):
        for b in range(4):
            start = HEADER + 3 * (((i + a) * ny + j + b) * nz + k)
            value = wp.vec3(0.0)
            slope = wp.vec3(0.0)
            for c in range(4):
                s = start + 3 * c
                node = wp.vec3(numbers[row, s], numbers[row, s + 1], numbers[row, s + 2])
                value += w[c] * node
                slope += dw[c] * node
            flux += u[a] * v[b] * value
            along_x += du[a] * v[b] * value
            along_y += u[a] * dv[b] * value
            along_z += u[a] * v[b] * slope
    gradient = wp.matrix_from_cols(along_x / spacing[0], along_y / spacing[1], along_z / spacing[2])
    return flux, gradient


@wp.func
def _linear(numbers: wp.array2d[float], row: int, x: wp.vec3):
    """Return a uniform field, or one with a gradient, and its gradient, in its own frame."""
    flux = wp.vec3(numbers[row, 0], numbers[row, 1], numbers[row, 2])
    gradient = wp.mat33(0.0)
    if numbers.shape[1] > UNIFORM:
        xx = numbers[row, 3]
        xy = numbers[row, 4]
        xz = numbers[row, 5]
        yy = numbers[row, 6]
        yz = numbers[row, 7]
        gradient = wp.mat33(xx, xy, xz, xy, yy, yz, xz, yz, -xx - yy)
        flux += gradient * x
    return flux, gradient


@wp.func
def flux_and_gradient(
    numbers: wp.array2d[float],
    scale: float,
    frame_type: int,
    frame: int,
    world: int,
    x: wp.vec3,
    xpos: wp.array2d[wp.vec3],
    xmat: wp.array2d[wp.mat33],
    site_xpos: wp.array2d[wp.vec3],
    site_xmat: wp.array2d[wp.mat33],
):
    """Return B of a field at a point, and dB_i/dx_j, in the world's frame."""
    origin = wp.vec3(0.0)
    axes = wp.identity(3, dtype=float)
    if frame_type == BODY:
        origin = xpos[world, frame]
        axes = xmat[world, frame]
    elif frame_type == SITE:
        origin = site_xpos[world, frame]
        axes = site_xmat[world, frame]
    row = world % numbers.shape[0]
    own = wp.transpose(axes) * (x - origin)
    flux = wp.vec3(0.0)
    gradient = wp.mat33(0.0)
    if numbers.shape[1] > GRADIENT:
        flux, gradient = _tabulated(numbers, row, own)
    else:
        flux, gradient = _linear(numbers, row, own)
    return scale * (axes * flux), scale * (axes * gradient * wp.transpose(axes))
