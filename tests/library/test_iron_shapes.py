"""Iron of true shape: forces against magpylib, images and series of multipoles; identities."""

import math

import magpylib
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from magmotor.numerics.demagnetization import demagnetizing_factors
from magmotor.numerics.iron import coulomb, interior, meshes, response

MU0 = 4e-7 * math.pi


def between(points, others):
    """The potential in 1/m and the field in 1/m^2 at points of unit charges at other points."""
    to = points[:, None] - others
    inverse = 1 / np.linalg.norm(to, axis=-1)
    return inverse / (4 * np.pi), to * inverse[..., None] ** 3 / (4 * np.pi)


def disk_magnet(diameter, height, remanence, rings=24, angles=64):
    """An axially magnetized cylinder as charges on its bases: points, and charges in T m^2.

    The rings are denser at the rim.
    """
    x, w = np.polynomial.legendre.leggauss(rings)
    inward, turn = (1 - x) / 2, 2 * np.pi / angles
    r, phi = np.meshgrid(diameter / 2 * (1 - inward**2), turn * np.arange(angles))
    base = np.stack([r * np.cos(phi), r * np.sin(phi), 0 * r], axis=-1).reshape(-1, 3)
    charges = remanence * (r * diameter / 2 * inward * w * turn).ravel()
    up = np.array([0, 0, height / 2])
    return np.concatenate([base + up, base - up]), np.concatenate([charges, -charges])


ROD, DISK = disk_magnet(0.01, 0.01, 1.3), disk_magnet(0.0127, 0.003175, 1.32)
BAR = [0.005, 0.005, 0.03]


def moved(magnet, shift, turn=None):
    points = magnet[0] if turn is None else turn.apply(magnet[0])
    return points + shift, magnet[1]


def fields(magnet, points):
    """Potential in T m and field in T of charges."""
    places, charges = magnet
    some = [between(part, places) for part in np.array_split(points, len(points) // 100 + 1)]
    potential = np.concatenate([p @ charges for p, _ in some])
    return potential, np.concatenate([np.einsum("ijk,j->ik", f, charges) for _, f in some])


def wrench(piece, magnet):
    potential, field = fields(magnet, piece.points)
    return piece.wrench(piece.charges(potential), field)


def polarized(piece, axis):
    """Integral of mu0 M, in T m^3, in a field of 1 T along an axis."""
    return piece.charges(-piece.points[:, axis]) @ piece.points


@pytest.fixture(scope="module")
def bar():
    return response.box(BAR, 0.0034, 1000.0)


def test_the_magnet_is_that_of_magpylib():
    magnet = magpylib.magnet.Cylinder(polarization=(0, 0, 1.3), dimension=(0.01, 0.01))
    points = np.array([[0.003, 0.001, 0.007], [0.008, 0.0, 0.002], [0.0, 0.002, -0.01]])
    assert np.abs(fields(ROD, points)[1] - magnet.getB(points)).max() < 1e-11  # 4e-13


END = {0.002: 9.20, 0.005: 2.147, 0.010: 0.3555, 0.020: 0.0304}
"""Gap in m: the pull in N of a bar's end by 36 x 8 x 8 cubes of magpylib, with a moment each.

28 x 6 x 6 cubes have 9.17 N at the narrowest gap, and 16 x 4 x 4 have 9.05.
"""


@pytest.mark.parametrize("gap", END)
def test_a_bar_is_pulled_at_its_end(bar, gap):
    pull = wrench(bar, moved(ROD, [0, 0, 0.035 + gap]))[0]
    assert pull[2] == pytest.approx(END[gap], rel=0.015)  # 0.0076
    assert np.abs(pull[:2]).max() < 1e-5 * pull[2]  # 7e-7


@pytest.mark.parametrize("along", [0.0, 0.0037, 0.01])
def test_a_bar_is_pulled_at_its_side(bar, along):
    """In its middle, those cubes have 2.21, 2.29 and 2.314 N: a series that nears 2.34 N."""
    side = Rotation.from_rotvec([0, np.pi / 2, 0])
    pull = wrench(bar, moved(ROD, [0.015, 0, along], side))[0]
    assert pull[0] == pytest.approx(2.34, rel=0.01)  # 0.0038


@pytest.mark.parametrize(("spacing", "bound"), [(0.005, 0.05), (0.0025, 0.01)])
def test_the_spacing_decides_on_the_error(spacing, bound):
    """The gap is 5 mm and more; the values are those of 936 nodes."""
    piece = response.box(BAR, spacing, 1000.0)
    found = [wrench(piece, moved(ROD, [0, 0, 0.035 + gap]))[0][2] for gap in [*END][1:]]
    assert found == pytest.approx([2.150, 0.3572, 0.0307], rel=bound)  # 0.044, 0.0017


def image_force(gap, susceptibility=1000.0):
    """The pull of the disk magnet on a half-space, which mirrors it."""
    height = 0.003175
    image = magpylib.magnet.Cylinder(
        polarization=(0, 0, 1.32), dimension=(0.0127, height), position=(0, 0, -2 * gap - height)
    )
    points, charges = disk_magnet(0.0127, height, 1.32, 60, 4)
    pull = -charges @ image.getB(points)[:, 2] / MU0
    return pull * susceptibility / (susceptibility + 2)


@pytest.fixture(scope="module")
def block():
    return response.box([0.03, 0.03, 0.01], 0.003, 1000.0)


def disk_force(block, gap, aside):
    return wrench(block, moved(DISK, [aside, 0, 0.01 + gap + 0.003175 / 2]))[0][2]


@pytest.mark.parametrize("aside", [0.0, 0.0015, 0.004])
@pytest.mark.parametrize(("gap", "bound"), [(0.002, 0.06), (0.003, 0.03), (0.005, 0.02)])
def test_a_thick_block_is_a_mirror(block, gap, bound, aside):
    assert disk_force(block, gap, aside) == pytest.approx(
        image_force(gap), rel=bound
    )  # 0.042, 0.02, 0.01


@pytest.mark.parametrize("aside", [0.0, 0.004, 0.012])
def test_near_contact_the_image_says_what_nodes_do_not_resolve(block, aside):
    """The image's energy at the true place, less that of a lifted magnet, which the nodes resolve.

    At contact, the pull is 34.1 N.
    """
    lifted = disk_force(block, 0.003, aside) - image_force(0.003)
    assert lifted + image_force(0.0) == pytest.approx(34.1, rel=0.01)  # 0.005


@pytest.mark.parametrize(("chi", "known"), [(math.inf, 3.6442), (-1.0, -1.6383)])
def test_cubes_have_known_polarizabilities(chi, known):
    """A. Sihvola et al., IEEE Trans. Antennas Propag. 52 (2004) 2226."""
    cube = response.box([1, 1, 1], 0.4, chi)
    found = polarized(cube, 2) / 8
    assert found[2] == pytest.approx(known, rel=0.02)  # 0.0034, 0.016
    assert np.abs(found[:2]).max() < 2e-5  # 4e-6


@pytest.mark.parametrize("chi", [-1.0, -1e-3, 0.1, 10.0, 1e4])
def test_ellipsoids_are_magnetized_uniformly(chi):
    axes = np.array([1.0, 1.5, 0.7])
    piece = response.ellipsoid(axes, 0.5, chi)
    factors = np.array(demagnetizing_factors(*axes))
    exact = 4 * np.pi / 3 * axes.prod() * np.diag(chi / (1 + chi * factors))
    found = np.array([polarized(piece, axis) for axis in range(3)])
    assert np.abs(found - exact).max() < 2e-3 * np.abs(exact).max()  # 6e-4


@pytest.mark.parametrize("chi", [-0.02, 0.02])
def test_a_weakly_magnetic_cylinder_has_the_mean_field_of_magpylib(chi):
    """To second order in chi, the mean of M is chi (1 - chi N) H with the magnetometric N."""
    piece = response.cylinder(1.0, 1.0, 0.5, chi)
    magnet = magpylib.magnet.Cylinder(polarization=(0, 0, 1), dimension=(2, 2))
    x, w = np.polynomial.legendre.leggauss(24)
    r, z = np.meshgrid((x + 1) / 2, x, indexing="ij")
    weights = (np.outer(w * (x + 1) / 2, w) / 2).ravel()
    inside = magnet.getH(np.stack([r, 0 * r, z], axis=-1).reshape(-1, 3))[:, 2]
    axial = -MU0 * weights @ inside / weights.sum()
    for axis, factor in ((2, axial), (0, (1 - axial) / 2)):
        found = polarized(piece, axis)[axis] / (2 * np.pi * chi)
        assert (1 - found) / chi == pytest.approx(factor, abs=0.005)  # 0.0025


def test_thin_disks_have_known_polarizabilities():
    """-8/3 of the radius cubed across a superconductor, and 16/3 along an ideal magnet."""
    disk = response.cylinder(1.0, 0.001, 0.3, -1.0)
    assert polarized(disk, 2)[2] == pytest.approx(-8 / 3, rel=0.1)  # 0.072
    assert polarized(disk, 0)[0] == pytest.approx(-np.pi * 0.002, rel=0.01)  # 0.0025
    disk = response.cylinder(1.0, 0.001, 0.3, math.inf)
    assert polarized(disk, 0)[0] == pytest.approx(16 / 3, rel=0.01)  # 0.0014


def test_forces_and_torques_are_derivatives_of_the_energy(bar):
    magnet = moved(ROD, [0.004, -0.003, 0.039], Rotation.from_rotvec([0.3, -0.5, 0.2]))

    def slope(one, two):
        return (bar.energy(fields(magnet, two)[0]) - bar.energy(fields(magnet, one)[0])) / 2

    force, torque = wrench(bar, magnet)
    step = 1e-5
    for axis, unit in enumerate(np.eye(3)):
        found = slope(bar.points + step * unit, bar.points - step * unit) / step
        assert found == pytest.approx(force[axis], abs=5e-5)  # 1.6e-5
        turn = Rotation.from_rotvec(1e-3 * unit)
        found = slope(turn.apply(bar.points), turn.inv().apply(bar.points)) / 1e-3
        assert found == pytest.approx(torque[axis], abs=2e-6)  # 8e-7


def test_a_constant_potential_induces_nothing(bar):
    charges = bar.charges(np.ones(len(bar.points)))
    assert np.abs(charges).max() < 1e-13 * np.abs(bar.matrix).max()  # 2e-15


def test_separation_of_variables_is_right():
    """It is compared with faces as unknowns, and with a linear potential."""
    lines = [meshes.spaced([-half, half], 0.5) for half in (0.5, 0.7, 1.0)]
    cells = meshes.cells_between(lines)
    found = interior.neumann_to_dirichlet_of_box(lines)
    other = interior.neumann_to_dirichlet(cells)
    for matrix in (found, other):
        matrix -= matrix.mean(axis=0)
        matrix -= matrix.mean(axis=1)[:, None]
    assert np.abs(found - other).max() < 5e-12 * np.abs(found).max()  # 2.4e-13
    panels, _ = meshes.panels(cells)
    middle = panels.mean(axis=1)
    flux = np.abs(meshes.area_vectors(panels)[:, 2]) * np.sign(middle[:, 2])
    assert np.abs(found @ flux - middle[:, 2]).max() < 1e-13  # 6e-15


def test_charged_squares_have_known_energies():
    """The mean of 1/r over a unit square, and the potential of a square at points far and near."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    far = square + np.array([5, 4, 3])
    own = 4 * math.log(1 + math.sqrt(2)) + 4 * (1 - math.sqrt(2)) / 3
    energies = 4 * np.pi * coulomb.mutual_energies(np.stack([square, far]))
    assert energies[0, 0] == pytest.approx(own, rel=0.01)  # 0.0028
    x, w = np.polynomial.legendre.leggauss(8)
    grid = np.stack(np.meshgrid(x, x, [1.0], indexing="ij"), axis=-1).reshape(-1, 3)
    weights, places = np.outer(w, w).ravel() / 4, (grid + 1) / 2 * [1, 1, 0]
    apart = weights @ between(places, places + far[0])[0] @ weights
    assert energies[0, 1] == pytest.approx(4 * np.pi * apart, rel=2e-5)  # 1.7e-6
    x, y = places[:, 0], places[:, 0] * places[:, 1]
    point, triangle = np.array([0.7, 0.3, 0.9]), np.stack([x, y, 0 * x], axis=-1)
    expected = weights @ (x / np.linalg.norm(triangle - point, axis=1))
    found = coulomb.triangle_potential(point, square[:3])
    assert found == pytest.approx(expected, rel=1e-8)  # 6e-10
