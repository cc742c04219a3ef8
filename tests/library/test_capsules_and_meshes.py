"""Magnets that are capsules and convex meshes: forces, torques, energy and fields, also in contact.

The judge integrates magpylib's field over the charges of one magnet with many points.
"""

import re
from typing import Any

import magpylib
import mujoco
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from test_shaped_magnets import (
    AROUND,
    FAR_NEEDLE,
    FLOOR,
    IRON,
    POSE,
    Shape,
    difference_from_gradient,
    force_of_dipoles,
    greatest_force,
    judged,
    loaded,
    random_shape,
    wrenches,
)

import magmotor as mm

GAUSS = np.polynomial.legendre.leggauss


class Capsule(Shape):
    def charges(self, order):
        radius, half = self.size
        x, w = GAUSS(order)
        angle = 2 * np.pi * (np.arange(2 * order) + 0.5) / (2 * order)
        round_it = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
        points = [radius * round_it + h for h in np.outer(half * x, [0, 0, 1])]
        charges = [round_it @ self.polarization * v * half * radius * np.pi / order for v in w]
        for sign in (-1, 1):
            for height, weight in zip((1 + x) / 2, w / 2, strict=True):
                normal = np.sqrt(1 - height**2) * round_it + [0, 0, sign * height]
                points.append(radius * normal + [0, 0, sign * half])
                charges.append(normal @ self.polarization * weight * radius**2 * np.pi / order)
        return self.rotation.apply(np.concatenate(points)) + self.position, np.concatenate(charges)

    def extent(self, direction):
        return self.size[0] + abs(self.rotation.inv().apply(direction)[2]) * self.size[1]

    def volume(self):
        return np.pi * self.size[0] ** 2 * (2 * self.size[1] + 4 / 3 * self.size[0])


class Mesh(Shape):
    """A convex hull of points in m, which are its `size`."""

    def __init__(self, points, polarization, position=(0, 0, 0), rotation=None, name="hull"):
        super().__init__("mesh", np.asarray(points, np.float32), polarization, position, rotation)
        self.name = name

    def asset(self, attributes=""):
        vertices = " ".join(map(repr, self.size.ravel().tolist()))
        return f'<mesh name="{self.name}" vertex="{vertices}" {attributes}/>'

    def geom(self, attributes=""):
        user = " ".join(map(repr, self.polarization.tolist()))
        return f'<geom type="mesh" mesh="{self.name}" user="{user}" mass="0.01" {attributes}/>'

    def faces(self):
        """Return the vertices (n, 3, 3) and the outward unit normals of triangles."""
        hull = ConvexHull(self.size)
        return self.size[hull.simplices], hull.equations[:, :3]

    def source(self) -> Any:
        return magpylib.magnet.TriangularMesh.from_ConvexHull(
            points=self.size, polarization=self.polarization, position=self.position,
            orientation=self.rotation,
        )  # fmt: skip

    def charges(self, order):
        x, w = GAUSS(order)
        x, w = (1 + np.sin(np.pi / 2 * x)) / 2, np.pi / 4 * np.cos(np.pi / 2 * x) * w
        u, v = np.meshgrid(x, x, indexing="ij")
        weights = (2 * u * np.outer(w, w)).ravel()
        weights /= weights.sum()
        parts = np.stack([1 - u, u * (1 - v), u * v], axis=-1).reshape(-1, 3)
        points, charges = [], []
        for corners, normal in zip(*self.faces(), strict=True):
            double = np.cross(corners[1] - corners[0], corners[2] - corners[0])
            points.append(parts @ corners)
            charges.append(weights * (0.5 * np.linalg.norm(double) * (normal @ self.polarization)))
        return self.rotation.apply(np.concatenate(points)) + self.position, np.concatenate(charges)

    def extent(self, direction):
        return (self.size @ self.rotation.inv().apply(direction)).max()

    def volume(self):
        return ConvexHull(self.size).volume


def random_mesh(rng):
    """Return the hull of points on an ellipsoid, or a prism; not about the origin of its frame."""
    scale = 0.01 * np.exp(rng.uniform(-1, 0.3, 3))
    if rng.random() < 0.5:
        points = rng.normal(size=(rng.integers(6, 16), 3))
        points *= scale / np.linalg.norm(points, axis=1, keepdims=True)
    else:
        angle = 2 * np.pi * np.arange(rng.integers(3, 9)) / 8
        points = [[np.cos(a), np.sin(a), z] for a in angle for z in (-1, 1)] * scale
    return points + rng.uniform(-0.3, 0.3, 3) * scale


def random_pair(rng):
    """Return two magnets whose gap is from 0 to ten sizes, one a mesh or a capsule."""
    other = random_shape(rng, ["box", "cylinder", "sphere"])
    one = random_shape(rng, ["cylinder"])
    if rng.random() < 0.5:
        one = Capsule("capsule", one.size, one.polarization, rotation=one.rotation)
    else:
        one = Mesh(random_mesh(rng), one.polarization, rotation=one.rotation, name="one")
        if rng.random() < 0.5:
            other = Mesh(random_mesh(rng), other.polarization, rotation=other.rotation)
    direction = Rotation.random(rng=rng).apply([0, 0, 1])
    size = max(abs(one.size).max(), abs(other.size).max())
    gap = 2 * size * np.exp(rng.uniform(np.log(1e-4), np.log(10)))
    one.position = (one.extent(-direction) + other.extent(direction) + gap) * direction
    return one, other


def assets(*shapes):
    return "".join(shape.asset() for shape in shapes if shape.kind == "mesh")


@pytest.mark.parametrize("turned", [False, True])
def test_random_pairs_from_contact_to_ten_sizes(turned):
    """Errors of 100 pairs, in the true force, or a third of the greatest possible."""
    rng = np.random.default_rng(6 + turned)
    errors, turns, of_dipoles = [], [], []
    for _ in range(50):
        one, other = random_pair(rng)
        pair = (other, one) if turned else (one, other)
        model, data = loaded(*(shape.body() for shape in pair), asset=assets(one, other))
        found = wrenches(model, data)[:: -1 if turned else 1]
        force, torque = judged(one, other)
        scale = max(np.linalg.norm(force), greatest_force(one, other) / 3)
        arm = np.linalg.norm(one.position - other.position)
        errors.append(np.linalg.norm(found[0, :3] - force) / scale)
        turns.append(np.linalg.norm(found[0, 3:] - torque) / (scale * arm))
        of_dipoles.append(np.linalg.norm(force_of_dipoles(one, other) - force) / scale)
        moved = found[1, 3:] + np.cross(other.position - one.position, found[1, :3])
        assert np.allclose(found[0, :3], -found[1, :3], rtol=0, atol=1e-12 * scale)
        assert np.allclose(found[0, 3:], -moved, rtol=0, atol=1e-12 * scale * arm)
    assert max(errors) < 0.03  # 0.004 and 0.011
    assert max(turns) < 0.03  # 0.002 and 0.006
    assert np.quantile(of_dipoles, 0.75) > 0.1  # 0.8 and 0.7


CORNERS = np.array([[x, y, z] for x in (-6, 6) for y in (-4, 4) for z in (-3, 3)]) * 1e-3
WEDGE = np.concatenate([CORNERS[:6], [[2e-3, 1e-3, 8e-3]]])


@pytest.mark.parametrize("kind", ["capsule", "mesh"])
@pytest.mark.parametrize("around", AROUND)
def test_forces_are_the_gradient_of_the_energy(kind, around):
    one = Capsule(kind, [4e-3, 2e-3], **POSE) if kind == "capsule" else Mesh(WEDGE, **POSE)
    found = difference_from_gradient(one, around, assets(one))
    assert found < 3e-6  # 1e-6, by rounding errors of the energy


def fields(one, points, attributes=""):
    """Return the flux density of a magnet near which another one is negligible."""
    asset = one.asset(attributes) if one.kind == "mesh" else ""
    model, data = loaded(one.body(), FAR_NEEDLE, asset=asset)
    mujoco.mj_forward(model, data)
    return mm.field(model, data, points)


FRAMES = {
    "": Rotation.identity(),
    'refpos="0.001 0.003 0.002"': Rotation.identity(),
    'refpos="0.001 0.003 0.002" refquat="0.9 0.1 0.3 0.2"': Rotation.from_quat([1, 3, 2, 9]),
    'inertia="shell"': Rotation.identity(),
}


@pytest.mark.parametrize("attributes", FRAMES)
def test_the_polarization_is_in_the_frame_that_is_declared(attributes):
    """MuJoCo moves the vertices into another one."""
    rng = np.random.default_rng(3)
    one = Mesh(random_mesh(rng), [0.2, 0.3, 1.2], [0.01, 0.02, 0.03], Rotation.random(rng=rng))
    shift = [0.001, 0.003, 0.002] if "refpos" in attributes else [0, 0, 0]
    seen = Mesh(FRAMES[attributes].inv().apply(one.size - shift), one.polarization, one.position)
    seen.rotation = one.rotation
    points = seen.size.mean(0) + rng.uniform(-1.5, 1.5, (200, 3)) * seen.size.std(0)
    points = seen.position + seen.rotation.apply(points)
    error = abs(fields(one, points, attributes) - seen.source().getB(points)).max(1)
    assert error.max() < 2e-5  # 9e-7 next to an edge, since vertices are rounded
    assert np.median(error) < 1e-7  # 6e-9


def test_the_field_inside_a_capsule_is_that_of_its_charges():
    one = Capsule("capsule", [4e-3, 2e-3], [0.2, 0.3, 1.2])
    points = np.random.default_rng(1).uniform(-2e-3, 2e-3, (20, 3))
    places, charges = one.charges(60)
    away = points[:, None] - places
    exact = (charges[:, None] * away / np.linalg.norm(away, axis=2)[..., None] ** 3).sum(1)
    exact = exact / (4 * np.pi) + one.polarization
    assert abs(fields(one, points) - exact).max() < 4e-13  # 1.4e-14


@pytest.mark.parametrize("around", ["box", "capsule"])
def test_a_mesh_is_the_shape_that_it_approximates(around):
    """A box exactly; a capsule with 400 vertices up to a few percent of its volume."""
    if around == "box":
        one, points = Shape("box", CORNERS[-1], **POSE), CORNERS
    else:
        one = Capsule("capsule", [4e-3, 2e-3], **POSE)
        angle, height = np.meshgrid(np.arange(20) * np.pi / 10, np.linspace(0, 0.99, 10))
        level, height = np.sqrt(1 - height**2).ravel(), height.ravel()
        cap = [level * np.cos(angle.ravel()), level * np.sin(angle.ravel()), height]
        points = np.concatenate(
            [one.size[0] * np.transpose(cap) * [1, 1, s] + [0, 0, s * one.size[1]] for s in (-1, 1)]
        )
    other = Shape("cylinder", [5e-3, 2e-3], [0, 0.3, 1.2])
    pulls = []
    for shape in (one, Mesh(points, **POSE)):
        model, data = loaded(shape.body(), other.body(), asset=assets(shape))
        pulls.append(wrenches(model, data) / shape.volume())
    error = abs(pulls[1] - pulls[0]).max() / abs(pulls[0]).max()
    assert error < (1e-6 if around == "box" else 0.05)  # 5e-8, as vertices are rounded, and 0.013


@pytest.mark.parametrize("kind", ["capsule", "mesh"])
def test_a_force_does_not_jump_where_magnets_sink_into_each_other(kind):
    """A box into a mesh, and a small one into the side of a capsule, or into its cap."""
    upright, half = [0, 0, 1.2], 3e-3 if kind == "mesh" else 1e-3
    others = [Mesh(CORNERS * [5 / 6, 5 / 4, 1], upright)]
    if kind == "capsule":
        lying = Rotation.from_euler("y", 90, degrees=True)
        others = [
            Capsule(kind, [3e-3, 9e-3], [-1.2, 0, 0], rotation=lying),
            Capsule(kind, [3e-3, 4e-3], upright, [0, 0, -4e-3]),
        ]
    for other in others:
        pulls = []
        for gap in (2e-5, 1e-5, 0, -1e-5, -2e-5):
            one = Shape("box", [5 / 3 * half, 5 / 3 * half, half], upright)
            one.position[2] = 3e-3 + half + gap
            model, data = loaded(one.body(), other.body(), asset=assets(other))
            pulls.append(wrenches(model, data)[0, 2])
        slopes = np.diff(pulls) / pulls[2]
        assert pulls[2] < -1
        assert abs(slopes).max() < 0.01  # 0.006 to 0.008, the slopes of the true forces


@pytest.mark.parametrize("kind", ["capsule", "mesh"])
def test_it_sticks_to_thick_iron(kind):
    """The plane acts as an equal magnet, the image."""
    upright = [0, 0, 1.2]
    one, image = (
        Capsule(kind, [4e-3, 2e-3], upright, [0, 0, height])
        if kind == "capsule"
        else Mesh(CORNERS * [1, 1, 2], upright, [0, 0, height])
        for height in (6.1e-3, -6.1e-3)
    )
    custom = IRON.format(1e9, "floor")
    asset = assets(one)
    model, data = loaded(one.body(), act="magnets iron", custom=custom, more=FLOOR, asset=asset)
    on_iron = wrenches(model, data)[0]
    if kind == "mesh":
        pull = judged(one, image, 80)[0][2]
    else:
        places, charges = one.charges(80)
        pull = sum(
            q * source for q, source in zip(charges, fields(image, places)[:, 2], strict=True)
        ) / (4e-7 * np.pi)
    assert on_iron[2] == pytest.approx(pull, rel=0.01)  # 1e-10 and 0.006


@pytest.mark.parametrize("kind", ["capsule", "mesh"])
def test_check_and_describe_know_them(kind):
    """The force at contact is right within a half."""
    one = Mesh(CORNERS, [0, 0, 1.2]) if kind == "mesh" else Capsule(kind, [4e-3, 2e-3], [0, 0, 1.2])
    height = one.extent([0, 0, 1]) + 2e-3
    other = Shape("cylinder", [4e-3, 2e-3], [0, 0, 1.2], [0, 0, height])
    model, data = loaded(one.body(), other.body(), asset=assets(one))
    true = abs(wrenches(model, data)[0, 2])
    model.geom_contype[:] = model.geom_conaffinity[:] = 1
    said = str(mm.check(model))
    found = re.search(r"attract each other with up to about ([\d.e+]+) N", said)
    quoted = float(found[1]) if found else 0.0
    assert quoted == pytest.approx(true, rel=0.5)  # 0.74 and 0.93 times as much
    assert "layout" not in said
    assert mm.describe(model).magnets == {"geom 0": 1.2, "geom 1": 1.2}
