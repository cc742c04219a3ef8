"""Magnets by their geom: forces, torques, energy and fields, also in contact.

The judge integrates magpylib's field over the charges of one magnet with many points.
"""

import re
from typing import Any

import magpylib
import mujoco
import numpy as np
import pytest
from energy_slopes import forces_by_energy
from scipy.spatial.transform import Rotation

import magmotor as mm

MU0 = 4e-7 * np.pi
PLUGIN = (
    '<extension><plugin plugin="magmotor.forces"><instance name="m"><config key="act" value="{}"/>'
    "</instance></plugin></extension>"
)


class Shape:
    """A magnet with a pose, for the judge and as MJCF."""

    def __init__(self, kind, size, polarization, position=(0, 0, 0), rotation=None):
        self.kind, self.size = kind, np.array(size, float)
        self.polarization = np.array(polarization, float)
        self.position = np.array(position, float)
        self.rotation = rotation or Rotation.identity()

    def geom(self, attributes=""):
        size, user = (" ".join(map(repr, row.tolist())) for row in (self.size, self.polarization))
        return f'<geom type="{self.kind}" size="{size}" user="{user}" mass="0.01" {attributes}/>'

    def body(self, inside="<freejoint/>"):
        quat = np.roll(self.rotation.as_quat(), 1)
        pos, quat = (" ".join(map(repr, row.tolist())) for row in (self.position, quat))
        return f'<body pos="{pos}" quat="{quat}">{inside}{self.geom()}</body>'

    def source(self) -> Any:
        """Return the same as magpylib's."""
        given = {
            "polarization": self.polarization, "position": self.position,
            "orientation": self.rotation,
        }  # fmt: skip
        if self.kind == "box":
            return magpylib.magnet.Cuboid(dimension=2 * self.size, **given)
        if self.kind == "cylinder":
            return magpylib.magnet.Cylinder(dimension=2 * self.size, **given)
        return magpylib.magnet.Sphere(diameter=2 * self.size[0], **given)

    def charges(self, order):
        """Return points of the surface (n, 3), and charges there in T m^2, by Gauss quadrature."""
        points, charges = [], []
        x, w = np.polynomial.legendre.leggauss(order)
        # Points gather at edges, where the field of another magnet may be singular.
        x, w = np.sin(np.pi / 2 * x), np.pi / 2 * np.cos(np.pi / 2 * x) * w
        if self.kind == "box":
            for axis in range(3):
                one, two = (k for k in range(3) if k != axis)
                u, v = np.meshgrid(x * self.size[one], x * self.size[two], indexing="ij")
                area = np.outer(w, w).ravel() * self.size[one] * self.size[two]
                for sign in (-1, 1):
                    place = np.full((u.size, 3), sign * self.size[axis])
                    place[:, one], place[:, two] = u.ravel(), v.ravel()
                    points.append(place)
                    charges.append(sign * self.polarization[axis] * area)
        elif self.kind == "cylinder":
            radius, half = self.size
            angle = 2 * np.pi * (np.arange(2 * order) + 0.5) / (2 * order)
            normal = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
            distance = radius * np.sqrt((1 + x) / 2)
            disk = (distance[:, None, None] * normal).reshape(-1, 3)
            area = np.repeat(w / 2, 2 * order) * np.pi * radius**2 / (2 * order)
            for sign in (-1, 1):
                points.append(disk + np.array([0, 0, sign * half]))
                charges.append(sign * self.polarization[2] * area)
            for height, weight in zip(x * half, w, strict=True):
                points.append(radius * normal + [0, 0, height])
                charges.append(normal @ self.polarization * weight * half * radius * np.pi / order)
        else:
            axes = np.broadcast_to(self.size, 3) if self.kind == "sphere" else self.size
            x, w = np.polynomial.legendre.leggauss(order)
            angle = 2 * np.pi * (np.arange(2 * order) + 0.5) / (2 * order)
            level = np.sqrt(1 - x**2)[:, None]
            unit = np.stack(
                [level * np.cos(angle), level * np.sin(angle), x[:, None] + 0 * angle], axis=-1
            ).reshape(-1, 3)
            points.append(unit * axes)
            weight = np.repeat(w, 2 * order) * np.pi / order
            charges.append(unit / axes @ self.polarization * np.prod(axes) * weight)
        return self.rotation.apply(np.concatenate(points)) + self.position, np.concatenate(charges)

    def extent(self, direction):
        """Return how far the magnet reaches along a direction of the world from its center."""
        d = self.rotation.inv().apply(direction)
        if self.kind == "box":
            return abs(d) @ self.size
        if self.kind == "cylinder":
            return np.hypot(d[0], d[1]) * self.size[0] + abs(d[2]) * self.size[1]
        return np.linalg.norm(d * self.size)

    def volume(self):
        a = self.size
        if self.kind == "box":
            return 8 * a.prod()
        if self.kind == "cylinder":
            return 2 * np.pi * a[0] ** 2 * a[1]
        return 4 / 3 * np.pi * (a[0] ** 3 if self.kind == "sphere" else a.prod())


def judged(one, other, order=40):
    """Return the force and the torque about its center on `one` near `other`."""
    points, charges = one.charges(order)
    forces = charges[:, None] * other.source().getH(points)
    return forces.sum(0), np.cross(points - one.position, forces).sum(0)


def wrenches(model, data):
    """Return the forces and the torques about its center on each free body."""
    mujoco.mj_forward(model, data)
    found = data.qfrc_passive.reshape(-1, 6).copy()
    for k, body in enumerate(range(1, model.nbody)):
        found[k, 3:] = data.xmat[body].reshape(3, 3) @ found[k, 3:]
    return found


def loaded(*bodies, act="magnets", custom="", more="", asset=""):
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0" integrator="RK4" timestep="1e-5"/>{PLUGIN.format(act)}'
        f'<custom>{custom}</custom><default><geom contype="0" conaffinity="0"/></default>'
        f"<asset>{asset}</asset><worldbody>{''.join(bodies)}{more}</worldbody></mujoco>"
    )
    return model, mujoco.MjData(model)


def random_shape(rng, kinds):
    kind = rng.choice(kinds)
    count = {"box": 3, "cylinder": 2, "ellipsoid": 3, "sphere": 1}[kind]
    size = 0.01 * np.exp(rng.uniform(-1, 0.3, count))
    polarization = np.array([0, 0, rng.uniform(0.3, 1.4)])
    if rng.random() < 0.3:
        polarization = Rotation.random(rng=rng).apply(polarization)
    return Shape(kind, size, polarization, rotation=Rotation.random(rng=rng))


def random_pair(rng):
    """Return two magnets whose gap is from 0 to ten sizes, the first of any shape."""
    other = random_shape(rng, ["box", "cylinder", "sphere"])
    one = random_shape(rng, ["box", "cylinder", "sphere", "ellipsoid"])
    direction = Rotation.random(rng=rng).apply([0, 0, 1])
    size = max(one.size.max(), other.size.max())
    gap = 2 * size * np.exp(rng.uniform(np.log(1e-4), np.log(10)))
    apart = one.extent(direction) + other.extent(direction) + gap
    one.position = apart * direction
    return one, other


def greatest_force(one, other):
    """Return the force of two dipoles in the best direction at the distance of two magnets."""
    moments = [np.linalg.norm(m.polarization) * m.volume() / MU0 for m in (one, other)]
    return 6e-7 * np.prod(moments) / np.linalg.norm(one.position - other.position) ** 4


@pytest.mark.parametrize("turned", [False, True])
def test_random_pairs_from_contact_to_ten_sizes(turned):
    """Errors of 500 pairs of all shapes, in the true force, or a third of the greatest possible.

    If each magnet is taken for a dipole, a quarter of the errors exceeds 10 %.
    """
    rng = np.random.default_rng(4 + turned)
    errors, turns, of_dipoles = [], [], []
    for _ in range(250):
        one, other = random_pair(rng)
        if turned:  # the order of bodies must not matter
            model, data = loaded(other.body(), one.body())
            found = wrenches(model, data)[::-1]
        else:
            model, data = loaded(one.body(), other.body())
            found = wrenches(model, data)
        force, torque = judged(one, other)
        scale = max(np.linalg.norm(force), greatest_force(one, other) / 3)
        arm = np.linalg.norm(one.position - other.position)
        errors.append(np.linalg.norm(found[0, :3] - force) / scale)
        turns.append(np.linalg.norm(found[0, 3:] - torque) / (scale * arm))
        of_dipoles.append(np.linalg.norm(force_of_dipoles(one, other) - force) / scale)
        # Both wrenches are about the same point.
        moved = found[1, 3:] + np.cross(other.position - one.position, found[1, :3])
        assert np.allclose(found[0, :3], -found[1, :3], rtol=0, atol=1e-12 * scale)
        assert np.allclose(found[0, 3:], -moved, rtol=0, atol=1e-12 * scale * arm)
    assert np.quantile(errors, 0.99) < 0.03  # 0.017 and 0.013
    assert np.quantile(turns, 0.99) < 0.03  # 0.007 and 0.005
    assert np.quantile(of_dipoles, 0.75) > 0.1  # 0.42


def force_of_dipoles(one, other):
    moments = [m.rotation.apply(m.polarization) * m.volume() / MU0 for m in (one, other)]
    return mm.dipoles.wrench(one.position, moments[0], [other.position], [moments[1]])[0]


DISK = Shape("cylinder", [6.35e-3, 1.5875e-3], [0, 0, 1.32])
"""A vendor's disk of 12.7 x 3.175 mm: 0.2952 T at the middle of its face, 34.1 N on thick iron."""

IRON = (
    '<numeric name="steel" data="{}"/><tuple name="iron"><element objtype="numeric"'
    ' objname="steel"/><element objtype="geom" objname="{}"/></tuple>'
)
FAR_NEEDLE = '<body pos="0 0 9"><freejoint/><geom size=".001" user="0 0 1e-9"/></body>'
"""Something on which a magnet acts."""

FLOOR = '<geom name="floor" type="plane" size="1 1 1"/>'


def test_the_disk_of_a_vendor():
    model, data = loaded(DISK.body(), FAR_NEEDLE)
    mujoco.mj_forward(model, data)
    above = mm.field(model, data, [[0, 0, 1.5875e-3], [0, 0, 1.5875e-3 + 0.8e-3], [0, 0, 0]])
    exact = DISK.source().getB([[0, 0, 1.5875e-3], [0, 0, 1.5875e-3 + 0.8e-3], [0, 0, 0]])
    assert above == pytest.approx(exact, rel=1e-9, abs=1e-12)
    assert above[0, 2] == pytest.approx(0.2952, abs=5e-5)


def test_it_sticks_to_thick_iron():
    """The plane acts as an equal magnet, the image. The judge cannot do without a gap."""
    pulls = []
    for gap in (0, 1e-5):
        height = 1.5875e-3 + gap
        on_iron = Shape("cylinder", DISK.size, DISK.polarization, [0, 0, height])
        custom = IRON.format(1e9, "floor")
        model, data = loaded(on_iron.body(), act="magnets iron", custom=custom, more=FLOOR)
        pulls.append(-wrenches(model, data)[0])
        assert abs(np.delete(pulls[-1], 2)).max() < 1e-12
    image = Shape("cylinder", DISK.size, DISK.polarization, [0, 0, -height])
    assert pulls[1][2] == pytest.approx(-judged(on_iron, image, 160)[0][2], rel=0.01)  # 0.004
    assert pulls[0][2] == pytest.approx(34.1, rel=0.01)  # 34.08


SITE = '<site name="needle" zaxis="1 1 0" user="0.05"/>'
PELLET = '<body pos="0.004 0.009 0.02"><freejoint/><geom name="pellet" size=".003"/></body>'


AROUND = "magnet", "mirror", "dipole", "iron", "units"
"""What a magnet is near to."""

POSE = {
    "polarization": [0.2, 0.3, 1.2], "position": [0, 0, 0.0075],
    "rotation": Rotation.from_euler("xyz", [0.3, 0.5, 0.2]),
}  # fmt: skip


@pytest.mark.parametrize("kind", ["box", "cylinder", "ellipsoid", "sphere"])
@pytest.mark.parametrize("around", AROUND)
def test_forces_are_the_gradient_of_the_energy(kind, around):
    size = {"box": [6, 4, 3], "cylinder": [5, 4], "ellipsoid": [6, 4, 3], "sphere": [5]}[kind]
    one = Shape(kind, 1e-3 * np.array(size), **POSE)
    assert difference_from_gradient(one, around) < 3e-6  # 7e-7, by rounding errors of the energy


def difference_from_gradient(one, around, asset=""):
    """Return the largest difference of a force from the gradient, in parts of the largest force."""
    other = Shape("box", [5e-3, 4e-3, 3e-3], [0.1, -0.4, 1.1], [0.009, 0.004, 0.012])
    bodies, act, custom, more = [one.body()], "magnets dipoles iron", "", ""
    if around in ("magnet", "mirror", "units"):
        bodies.append(other.body())
    if around == "mirror":
        custom, more = IRON.format(500, "floor"), FLOOR
    if around == "dipole":
        bodies.append(f'<body pos="0.004 0.008 0.012"><freejoint/><geom size=".001"/>{SITE}</body>')
    if around == "iron":
        custom, bodies = IRON.format(500, "pellet"), [*bodies, PELLET]
    if around == "units":
        custom = '<numeric name="magnetic_constant" data="3e-6"/>'
    model, data = loaded(*bodies, act=act, custom=custom, more=more, asset=asset)
    mujoco.mj_forward(model, data)
    forces, expected = data.qfrc_passive, forces_by_energy(model, data, 1e-6)
    scale = np.repeat([abs(forces[:3]).max(), abs(forces[:3]).max() * 0.005], 3)
    scale = np.tile(scale, model.nv // 6)
    assert np.isfinite(forces).all()
    assert scale.all()
    return (abs(forces - expected) / scale).max()


def test_far_magnets_are_dipoles():
    one = Shape("box", [3e-3, 4e-3, 5e-3], [0.3, 0, 1.2], [0.1, 0.2, 0.15])
    other = Shape("cylinder", [3e-3, 2e-3], [0, 0, 1.2])
    model, data = loaded(one.body(), other.body())
    found = wrenches(model, data)[0, :3]
    assert found == pytest.approx(force_of_dipoles(one, other), rel=1e-12)


def test_energy_is_kept_to_the_order_of_rk4():
    """Two disks that swing about each other; a step of half the length errs 1/16 as much."""
    one = Shape("cylinder", [5e-3, 2e-3], [0, 0, 1.2], [0.002, 0.001, 0.0105])
    other = Shape("cylinder", [5e-3, 2e-3], [0, 0, 1.2])
    model, data = loaded(one.body(), other.body())
    drifts = []
    for steps in (100, 200, 400):
        mujoco.mj_resetData(model, data)
        data.qvel[:3] = 0.3, 0.1, 0.4
        model.opt.timestep = 4e-3 / steps
        mujoco.mj_forward(model, data)
        before = total_energy(model, data)
        mujoco.mj_step(model, data, steps)
        mujoco.mj_forward(model, data)
        drifts.append(abs(total_energy(model, data) - before))
    assert 10 < drifts[0] / drifts[1] < 24  # 15.9 and 15.9
    assert 10 < drifts[1] / drifts[2] < 24


def total_energy(model, data):
    inertia = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, inertia, data.qvel)
    return mm.magnetic_energy(model, data) + 0.5 * inertia @ data.qvel


def test_a_force_does_not_jump_where_magnets_sink_into_each_other():
    """Contacts are soft. The field inside is opposite, so that the true force would reverse."""
    pulls = []
    for gap in (2e-5, 1e-5, 0, -1e-5, -2e-5):
        one = Shape("box", [5e-3, 5e-3, 3e-3], [0, 0, 1.2], [0, 0, 6e-3 + gap])
        other = Shape("box", [5e-3, 5e-3, 3e-3], [0, 0, 1.2])
        model, data = loaded(one.body(), other.body())
        pulls.append(wrenches(model, data)[0, 2])
    slopes = np.diff(pulls) / pulls[2]
    assert pulls[2] == pytest.approx(-37.64, rel=0.001)  # 4e-5 of the limit of the true force
    assert slopes[:2] == pytest.approx([0.01011, 0.01279], rel=0.05)  # 0.002 of the true slopes
    assert (slopes > 0).all()
    assert slopes.max() == slopes[1]  # it changes less within


@pytest.mark.parametrize("shape", ["cuboid", "cylinder", "sphere", "ring"])
def test_a_magnet_writes_itself(shape):
    """With its polarization, and with the same field as magpylib's ring."""
    size = {
        "cuboid": (0.01, 0.02, 0.005), "cylinder": (0.01, 0.005), "sphere": 0.01,
        "ring": (0.005, 0.01, 0.004),
    }[shape]  # fmt: skip
    text = mm.magnet(shape, size, remanence=1.2, direction=(0, 1, 1)).mjcf()
    model, data = loaded(f"<body><freejoint/>{text}</body>", FAR_NEEDLE)
    mujoco.mj_forward(model, data)
    polarization = 1.2 * np.array([0, 1, 1]) / np.sqrt(2)
    magnet = magpylib.magnet
    exact = {
        "cuboid": lambda: magnet.Cuboid(polarization=polarization, dimension=size),
        "cylinder": lambda: magnet.Cylinder(polarization=polarization, dimension=size),
        "sphere": lambda: magnet.Sphere(polarization=polarization, diameter=size),
        "ring": lambda: magnet.CylinderSegment(
            polarization=polarization, dimension=(0.0025, 0.005, 0.004, 0, 360)
        ),
    }[shape]()
    points = np.random.default_rng(0).uniform(-0.012, 0.012, (50, 3))
    exact = exact.getB(points)
    errors = np.linalg.norm(mm.field(model, data, points) - exact, axis=1)
    errors /= np.linalg.norm(exact, axis=1)
    assert np.median(errors) < 5e-12  # 1.8e-13
    assert errors.max() < 0.01  # 0.0019, where what the ring's hole takes away is a dipole


def test_check_takes_it_for_a_layout_that_is_right_in_contact():
    """The true force of two disks that touch is 34.1 N; two dipoles would have 1050 N."""
    other = Shape("cylinder", DISK.size, DISK.polarization, [0, 0, 0.02])
    model = loaded(DISK.body(""), other.body())[0]
    model.geom_contype[:] = model.geom_conaffinity[:] = 1
    said = str(mm.check(model))
    found = re.search(r"attract each other with up to about ([\d.e+]+) N", said)
    quoted = float(found[1]) if found else 0.0
    assert quoted == pytest.approx(34.1, rel=0.5)  # 45.1
    assert "layout" not in said
    assert mm.describe(model).magnets == {"geom 0": 1.32, "geom 1": 1.32}
    assert mm.describe(model).acting == ("magnets",)


def test_a_spec_gets_it_with_the_mark():
    """Also a spec that says how many numbers its geoms have."""
    spec = mujoco.MjSpec()
    spec.nuser_geom = 1
    disk = mm.magnet("cylinder", (0.0127, 0.003175), remanence=1.32)
    for height in (0, 0.003175):
        body = spec.worldbody.add_body(pos=[0, 0, height])
        body.add_freejoint()
        geoms, sites = mm.add_magnet(spec, body, disk)
        assert (len(geoms), len(sites)) == (1, 0)
    model = spec.compile()
    data = mujoco.MjData(model)
    assert wrenches(model, data)[0, 2] == pytest.approx(34.1, rel=0.01)
    with pytest.raises(mm.ArgumentError, match="both or none"):
        mm.add_magnet(spec, body, disk, error=0.1)
