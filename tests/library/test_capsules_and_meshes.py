"""Magnets that are capsules and convex meshes: forces, torques, energy and fields, also in contact.

The judge integrates magpylib's field over the charges of one magnet with many points.
"""

import magpylib
import mujoco
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from test_shaped_magnets import (
    FLOOR,
    IRON,
    PELLET,
    SITE,
    Shape,
    force_of_dipoles,
    greatest_force,
    judged,
    loaded,
    random_shape,
    turned_by,
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

    def source(self):
        corners, normals = self.faces()
        turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        inward = (turned * normals).sum(1) < 0
        corners[inward] = corners[inward, ::-1]
        return magpylib.magnet.TriangularMesh(
            vertices=corners.reshape(-1, 3), faces=np.arange(3 * len(corners)).reshape(-1, 3),
            polarization=self.polarization, position=self.position, orientation=self.rotation,
            reorient_faces="skip", check_open="skip", check_disconnected="skip",
            check_selfintersecting="skip",
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
    print("ERR", np.quantile(errors, [.5, .9, .97, .99, 1]), np.quantile(turns,[.5, .9, .97, .99,1]), np.quantile(of_dipoles,.75))
