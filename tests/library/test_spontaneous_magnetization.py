"""Iron that would magnetize without any field is an error, whether it saturates or not."""

import math

import mujoco
import numpy as np
import pytest
from iron_models import factors, free, iron, load
from magnetic_energy import matrix_of_iron
from scipy.linalg import eigvalsh

import magmotor as mm
from magmotor.mjcf.field_and_energy import dipole_sites

ROD = 'type="capsule" size="0.01 0.2"'
CUBES = "".join(free('type="box" size="1 1 1"', f"0 0 {2 * k}", f"p{k}") for k in range(10))
PLATE = 'type="cylinder" size="1 0.02"'
TOUCHING = {
    "rods side by side": free(ROD, name="p0") + free(ROD, "0.021 0 0", "p1"),
    "a bar of cubes": CUBES,
    "plates": free(PLATE, name="p0") + free(PLATE, "0 0 0.04", "p1"),
    "a rod on a plane": '<geom name="p0" type="plane" size="1 1 1"/>'
    + free(ROD + ' euler="90 0 0"', "0 0 0.0101", "p1"),
    "a coin on a plane": '<geom name="p0" type="plane" size="1 1 1"/>'
    + free(PLATE, "0 0 0.021", "p1"),
}


FAR = '<body pos="0 0 999"><freejoint/><geom size="1"/><site user="1e-9"/></body>'


def refuse(model):
    """Assert that iron would magnetize itself, by what a step and the energy say."""
    data = mujoco.MjData(model)
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_forward(model, data)
    unsolved = lambda error: error.kind == "unsolved"  # noqa: E731
    with pytest.raises(mm.DeclarationError, check=unsolved) as outside:
        mm.magnetic_energy(model, data)
    assert str(in_a_step.value) == str(outside.value)


@pytest.mark.parametrize("name", TOUCHING)
@pytest.mark.parametrize("field", ["0 0 0.01", "0.3 0 0", "0 0 0"])
@pytest.mark.parametrize("material", ["1000", "1000 1.7e6", "1000 1"])
def test_long_or_flat_pieces_that_touch(name, field, material):
    """In any field; with saturation, the moments would be bounded, and wrong."""
    names = " ".join(f"p{k}" for k in range(10 if "cubes" in name else 2))
    refuse(load(TOUCHING[name], field, material, names))


PLANE = '<geom name="p0" type="plane" size="1 1 1"/>'


@pytest.mark.parametrize(("piece", "limit"), [
    ('type="cylinder" size="{0} 1" pos="0 0 1"', 1.9),
    ('type="box" size="{0} {0} 1" pos="0 0 1"', 1.7),
    ('type="cylinder" size="1 {0}" pos="0 0 1" euler="90 0 0"', 2.3),
])  # fmt: skip
def test_how_flat_or_long_a_piece_may_be_that_lies_on_a_plane(piece, limit):
    """The numbers of docs/fields_coils_iron.md: width over height, or length over width."""
    low, high = 1.0, 4.0
    while high - low > 0.01:
        ratio = (low + high) / 2
        try:
            iron(PLANE + f'<geom name="p1" {piece.format(ratio)}/>' + FAR, pieces="p0 p1")
            low = ratio
        except mujoco.FatalError:
            high = ratio
    assert low == pytest.approx(limit, abs=0.05)


def test_a_row_of_seven_cubes_is_an_error():
    row = "".join(free('type="box" size="1 1 1"', f"0 0 {2 * k}", f"p{k}") for k in range(7))
    iron(row, pieces="p0 p1 p2 p3 p4 p5")
    refuse(load(row, pieces="p0 p1 p2 p3 p4 p5 p6"))


def test_a_rod_alone_and_far_from_others():
    model, data = iron(free(ROD, name="a"), material="1000 1.7e6", pieces="a")
    alone = dipole_sites(model, data)[1]
    model, data = iron(free(ROD, name="a") + free(ROD, "2 0 0", "b"), pieces="a b")
    np.testing.assert_allclose(dipole_sites(model, data)[1], [*alone, *alone], rtol=0.04)  # 0.01


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("chi", [-0.9, 0.5, 30.0, 1e4])
def test_the_limit_is_that_of_a_definite_matrix(seed, chi):
    """Ellipsoids at random, half of them above a plane; the coupling is scaled by the distance.

    With an identity on the diagonal, 1 minus the smallest eigenvalue is the coupling. For
    diamagnets, the matrix must be negative definite.
    """
    rng, count = np.random.default_rng(seed), 6
    places = rng.normal((0, 0, 4), 1, (count, 3))
    sizes, quats = rng.uniform(0.2, 1, (count, 3)), rng.normal(size=(count, 4))
    plane = '<geom name="plane" type="plane" size="1 1 1"/>' if seed % 2 else ""
    mirror = ([0, 0, 0], np.array([0, 0, 1]), chi / (chi + 2)) if plane else None

    def arranged(scale):
        bodies = "".join(
            f'<geom name="p{k}" type="ellipsoid" size="{a} {b} {c}" quat="{w} {x} {y} {z}"'
            f' pos="{u * scale} {v * scale} {h * scale}"/>'
            for k, ((a, b, c), (w, x, y, z), (u, v, h)) in enumerate(
                zip(sizes.tolist(), quats.tolist(), places.tolist(), strict=True)
            )
        )
        names = " ".join(f"p{k}" for k in range(count)) + " plane" * bool(plane)
        magnet = '<body pos="0 0 99"><freejoint/><geom size="1"/><site user="1"/></body>'
        return load(plane + bodies + magnet, material=f"{chi} 1e5", pieces=names)

    model = arranged(1.0)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    solid = slice(int(bool(plane)), int(bool(plane)) + count)
    pieces = [
        (place, 4 / 3 * math.pi * np.prod(size), axes @ np.diag(material) @ axes.T)
        for place, size, axes, material in zip(
            data.geom_xpos[solid], sizes, data.geom_xmat[solid].reshape(-1, 3, 3),
            [chi / (1 + chi * factors(size)) for size in sizes], strict=True,
        )
    ]  # fmt: skip
    matrix = np.real(matrix_of_iron(pieces, mirror))
    own = np.zeros_like(matrix)
    for k, piece in enumerate(pieces):
        own[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = np.real(matrix_of_iron([piece]))
    coupling = 1 - eigvalsh(math.copysign(1, chi) * matrix, math.copysign(1, chi) * own)[0]
    for allowed, expected in ((0.9, True), (1.01, False)):
        model = arranged((coupling / allowed) ** (1 / 3))
        if expected:
            with mm.magnetism():
                mujoco.mj_forward(model, mujoco.MjData(model))
        else:
            refuse(model)


def close_packed(count):
    """The centers of touching spheres of radius 1/2 that are closest to one point of a lattice."""
    index = np.mgrid[-5:6, -5:6, -5:6].reshape(3, -1).T
    places = index @ np.array([[0, 1, 1], [1, 0, 1], [1, 1, 0]]) / math.sqrt(2)
    return places[np.argsort(np.linalg.norm(places - [0.01, 0.02, 0.03], axis=1))[:count]]


@pytest.mark.parametrize("places", [
    np.arange(100)[:, None] * [[0.6, 0.0, 0.8]], close_packed(100)
], ids=["chain", "lump"])  # fmt: skip
@pytest.mark.parametrize("material", ["1000", "1000 1.7e6"])
def test_touching_spheres_are_stable(places, material):
    """The moments solve the linear equations, in a field in which nothing saturates."""
    bodies = "".join(
        f'<geom name="p{k}" size="0.5" pos="{x} {y} {z}"/>'
        for k, (x, y, z) in enumerate(places.tolist())
    )
    bodies += FAR
    names = " ".join(f"p{k}" for k in range(len(places)))
    model, data = iron(bodies, "1e-5 2e-5 -3e-5", material, names)
    chi = np.eye(3) * 1000 / (1 + 1000 / 3)
    pieces = [(place, math.pi / 6, chi) for place in places]
    outer = np.tile([1e-5, 2e-5, -3e-5], len(places))
    expected = np.linalg.solve(np.real(matrix_of_iron(pieces)), outer).reshape(-1, 3)
    size, bound = np.abs(expected).max(), 3e-10 if " " in material else 3e-13  # 2e-11, 2e-14
    found = dipole_sites(model, data)[1][1:]
    np.testing.assert_allclose(found, expected, rtol=0, atol=bound * size)
