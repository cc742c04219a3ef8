"""A plane of soft iron, which acts on dipoles as their mirror images do.

A plane geom in a tuple of iron (see `iron.py`) fills the half-space below it. Above it, its field
is that of the dipoles' images: m at a point becomes k (2 (m.n) n - m) at the mirrored point, where
n is the normal and k = chi/(chi + 2). The field and the force of all images at a dipole follow from
those of the dipoles themselves at the mirrored place. Applied fields are left as they are.
"""

from magmotor.mjcf import memory
from magmotor.numerics.deferred import subroutine

NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False)
"""A sum over no sources, as of `magmotor.dipoles.sum_over_sources`."""

NO_MIRROR = (0.0, 0.0, 0.0, 0.0, 0.0)
"""The strength k of the images, the normal, and the height of the plane along it."""


@subroutine
def mirror_of(plane, susceptibility, d, offsets):
    """Return the mirror that a plane geom is: its strength, normal and height along the normal."""
    position = memory.numbers(d[offsets.geom_xpos // 8], memory.UNBOUNDED, 3)
    frame = memory.numbers(d[offsets.geom_xmat // 8], memory.UNBOUNDED, 9)
    nx, ny, nz = frame[plane, 2], frame[plane, 5], frame[plane, 8]
    height = nx * position[plane, 0] + ny * position[plane, 1] + nz * position[plane, 2]
    return susceptibility / (susceptibility + 2.0), nx, ny, nz, height


@subroutine
def height_above(mirror, x, y, z):
    """Return the height of a point above the plane."""
    return mirror[1] * x + mirror[2] * y + mirror[3] * z - mirror[4]


@subroutine
def mirrored(mirror, target):
    """Return a dipole's position and moment, both reflected by the plane as vectors are."""
    _, nx, ny, nz, _ = mirror
    x, y, z, mx, my, mz = target
    shift = -2.0 * height_above(mirror, x, y, z)
    place = x + shift * nx, y + shift * ny, z + shift * nz
    return (*place, *reflected(mirror, mx, my, mz))


@subroutine
def mirrored_pose(mirror, pose):
    """Return the center and the frame of a reflected magnet; its axes are of the other hand."""
    cx, cy, cz, xx, yx, zx, xy, yy, zy, xz, yz, zz = pose
    place = mirrored(mirror, (cx, cy, cz, xx, xy, xz))
    y, z = reflected(mirror, yx, yy, yz), reflected(mirror, zx, zy, zz)
    return (
        place[0], place[1], place[2],
        place[3], y[0], z[0], place[4], y[1], z[1], place[5], y[2], z[2],
    )  # fmt: skip


@subroutine
def add_image(total, there, mirror):
    """Add the force and the field of images on a target to those of other sources.

    `there` are the force and the field of the images' dipoles on the `mirrored` target; all are as
    in `magmotor.dipoles.sum_over_sources`.
    """
    strength, nx, ny, nz, _ = mirror
    fx, fy, fz, bx, by, bz, coincident = there
    push = 2.0 * (nx * fx + ny * fy + nz * fz)
    flux = 2.0 * (nx * bx + ny * by + nz * bz)
    return (
        total[0] + strength * (push * nx - fx),
        total[1] + strength * (push * ny - fy),
        total[2] + strength * (push * nz - fz),
        total[3] + strength * (flux * nx - bx),
        total[4] + strength * (flux * ny - by),
        total[5] + strength * (flux * nz - bz),
        total[6] or coincident,
    )


@subroutine
def reflected(mirror, x, y, z):
    """Return a vector that the plane of a mirror reflects."""
    along = 2.0 * (mirror[1] * x + mirror[2] * y + mirror[3] * z)
    return x - along * mirror[1], y - along * mirror[2], z - along * mirror[3]
