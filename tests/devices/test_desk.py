"""Motors of other sizes with the paper's dimensionless groups."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.linalg import solve_banded
from scipy.optimize import minimize_scalar

import magmotor as mm
from magmotor.devices.motor.ring_stability import ring_stiffness
from magmotor.observables import motor_wells

DESK = mm.Motor.desk()


@pytest.mark.parametrize("run", ["uniform-a", "nonuniform-a"])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"inner_radius": 0.31, "grade": "C5", "magnet_fraction": 1.0},
    ],
)
def test_the_same_groups_give_the_same_run_in_scaled_units(run, options):
    """On one Brownian path, to rounding, for 2000 steps."""
    paper, desk = mm.Motor.paper(run), mm.Motor.desk(run, **options)
    scale = desk.units.time / paper.units.time
    runs = [
        mm.simulate(
            scene, method="variational/middle", timestep=step, duration=2000 * step, seed=2,
            record_interval=10,
        )
        for scene, step in ((paper, 0.4), (desk, 0.4 * scale))
    ]  # fmt: skip
    places = [r.position.values / s.inner_radius for r, s in zip(runs, (paper, desk), strict=True)]
    assert np.abs(places[0] - places[1]).max() < 6e-14  # 2e-15
    assert np.abs(places[0] - places[0][0]).max() > 0.01  # 0.012 and 0.15
    heats = [r.heat.values / s.units.energy for r, s in zip(runs, (paper, desk), strict=True)]
    np.testing.assert_allclose(*heats, rtol=0, atol=3e-13 * heats[0].max())  # 1e-14


def test_all_groups_but_the_weight_are_the_papers():
    paper, desk = mm.Motor().groups._asdict(), mm.Motor.desk().groups._asdict()
    weights = paper.pop("weight"), desk.pop("weight")
    assert desk == pytest.approx(paper, rel=1e-14, abs=0)
    assert weights[0] / weights[1] > 100  # 318: the magnets are that much stronger


def test_the_desk_of_solid_magnets():
    """The values of an independent calculation, for a remanence of 1.26 T instead of 1.265 T.

    There, all magnets had the ball's moment, and the pairs of ball and inner ring counted twice.
    Here, the outer magnets have half of the moment, so that energies are half as large.
    """
    desk = mm.Motor.desk(grade="N40", magnet_fraction=1.0)
    assert desk.ball_radius == pytest.approx(10.7e-3, rel=0.005)
    assert desk.ball_mass == pytest.approx(0.038, rel=0.01)
    ball = mm.magnet("sphere", (2 * desk.ball_radius,), grade="N40")
    assert ball.moment == pytest.approx(5.1, rel=0.01)
    assert math.sqrt(2) * desk.moment == pytest.approx(ball.moment, rel=1e-12)
    assert desk.units.time / math.sqrt(2) == pytest.approx(2.2, rel=0.02)
    assert 2 * desk.kT == pytest.approx(2.3e-4, rel=0.01)
    assert math.sqrt(2) * desk.friction_ball == pytest.approx(1.3, rel=0.01)
    assert math.sqrt(2) * desk.frictions[-1] == pytest.approx(0.09, rel=0.03)
    barrier = motor_wells(desk).barrier
    assert barrier / desk.kT == pytest.approx(motor_wells(mm.Motor()).barrier / mm.Motor().kT)


@pytest.mark.parametrize("scene", [mm.Motor(), DESK, DESK.replace(ball_ring_factor=1.0)])
def test_the_magnets_have_the_energies_of_the_scene(scene):
    """The ball's in the field of magnets that count once, and that of a pair of ring magnets."""
    bill = scene.bill_of_materials("N42")
    point = scene.inner_radius * np.array([0.6, 0.3, 0.05])
    inner, outward = scene.inner_dipole_frame()
    outer, moments = scene.outer_sources()
    places = np.vstack([inner + np.array([0, 0, scene.inner_height]), outer])
    magnets = np.vstack([bill.inner.moment * outward, bill.outer.moment / scene.moment * moments])
    energy = bill.ball_moment * mm.dipoles.field(point, places, magnets)
    expected = scene.moment * mm.dipoles.field(point, *scene.ring_sources())
    np.testing.assert_allclose(energy, expected, rtol=1e-12)
    assert bill.inner.moment * bill.outer.moment == pytest.approx(scene.moment**2, rel=1e-12)


def test_the_parts_fit_and_have_their_moments():
    bill = DESK.bill_of_materials("N42")
    ball = mm.magnet("sphere", (bill.ball_magnet_diameter,), grade="N42")
    assert ball.moment == pytest.approx(bill.ball_moment, rel=1e-12)
    assert ball.mass == pytest.approx(bill.ball_magnet_mass, rel=1e-12)
    for ring in (bill.inner, bill.outer):
        for shape, size in (("cuboid", (ring.cube,) * 3), ("cylinder", ring.cylinder)):
            magnet = mm.magnet(shape, size, grade="N42")
            assert magnet.moment == pytest.approx(ring.moment, rel=1e-12)
            assert magnet.mass == pytest.approx(ring.mass, rel=1e-12)
    assert bill.carrier_mass + 20 * bill.inner.mass == pytest.approx(DESK.inner_mass)
    assert bill.carrier_mass > 0.25 * DESK.inner_mass  # 0.30
    places = DESK.inner_dipole_frame()[0]
    magnets = bill.inner.mass * np.sum(places[:, :2] ** 2)
    assert bill.carrier_inertia + magnets == pytest.approx(DESK.inner_moments[2], rel=1e-12)
    assert bill.shell_density == pytest.approx(7500)
    assert abs(bill.ball_inertia_excess) < 1e-14
    assert bill.ball_magnet_diameter == pytest.approx(0.016, rel=2e-3)  # 0.01598, as is sold
    assert 2 * math.pi * DESK.inner_radius / 20 > 3 * bill.inner.cube


def test_the_inertia_of_a_ball_with_a_light_shell():
    """Against a quadrature over shells: the paper's ball with a magnet of N42."""
    scene = mm.Motor()
    bill = scene.bill_of_materials("N42")
    x, w = np.polynomial.legendre.leggauss(12)
    edges = [0, bill.ball_magnet_diameter / 2, scene.ball_radius]
    mass = inertia = 0.0
    for low, high, density in zip(edges, edges[1:], (7500, bill.shell_density), strict=False):
        r = (low + high) / 2 + (high - low) / 2 * x
        layers = density * 4 * math.pi * r**2 * w * (high - low) / 2
        mass, inertia = mass + layers.sum(), inertia + 2 / 3 * (layers * r**2).sum()
    assert mass == pytest.approx(scene.ball_mass, rel=1e-12)
    assert inertia / scene.ball_inertia - 1 == pytest.approx(bill.ball_inertia_excess, rel=1e-9)
    assert bill.ball_inertia_excess < -0.05  # -0.068


def test_cylinders_of_the_bill_have_no_octupole():
    """Its axial part is that of 2 z^2 - x^2 - y^2 over the volume, of a quadrature."""
    diameter, height = DESK.bill_of_materials("N42").inner.cylinder
    points, weights = np.polynomial.legendre.leggauss(4)
    z = height / 2 * points
    r = diameter / 4 * (1 + points)
    squares = 2 * np.average(z**2, weights=weights) - np.average(r**2, weights=weights * r)
    assert abs(squares) < 3e-15 * diameter**2  # 1e-16


def around(scene, sources=None):
    """Least energies of the ball in the directions of 24 azimuths, found by bounded search."""
    found = []
    for angle in 2 * math.pi * np.arange(24) / 24:
        ahead = np.array([math.cos(angle), math.sin(angle)])

        def energy(rho, ahead=ahead):
            center = np.array([*(rho * ahead), scene.ball_radius])
            places, moments = sources or scene.ring_sources()
            arm = center - places
            distance = np.linalg.norm(arm, axis=1)[:, None]
            along = (arm * moments).sum(axis=1)[:, None]
            field = 1e-7 * (3 * arm * along / distance**5 - moments / distance**3).sum(axis=0)
            field = field + scene.background_field
            lift = scene.ball_mass * np.dot(scene.gravity_vector, center)
            return -scene.moment * np.linalg.norm(field) - lift

        at = 0.79 * scene.inner_radius
        lowest: Any = minimize_scalar(energy, bounds=(0.9 * at, 1.1 * at), method="bounded")
        found.append(lowest.fun)
    return np.array(found)


def test_tolerances_change_the_valley_by_a_barrier():
    """Against energies by another program, for a tenth of each tolerance, and both signs."""
    scene = mm.Motor()
    allowed = mm.theory.motor_tolerances(scene)
    positions, moments = scene.ring_sources()
    inner = np.arange(25) < 20
    first = np.arange(25) == 0

    def leaning(angle):
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        center = np.array([0, 0, scene.inner_height])
        places = np.where(inner[:, None], (positions - center) @ turn.T + center, positions)
        return scene, (places, np.where(inner[:, None], moments @ turn.T, moments))

    changes = {
        "floor_tilt": lambda size: (scene.replace(floor_tilt=(size, 0)),),
        "background_field": lambda size: (scene.replace(background_field=(size, 0, 0)),),
        "ring_lean": leaning,
        "inner_moment": lambda size: (scene, (positions, moments * (1 + size * first)[:, None])),
        "inner_place": lambda size: (scene, (positions + np.outer(first, [size, 0, 0]), moments)),
    }
    barrier = motor_wells(scene).barrier
    for name, changed in changes.items():
        size = 0.1 * getattr(allowed, name)
        up, down = (around(*changed(sign * size)) for sign in (1, -1))
        assert np.ptp(up - down) / 2 == pytest.approx(0.1 * barrier, rel=0.02), name  # 0.003


@pytest.mark.parametrize("scene", [mm.Motor(), DESK])
def test_an_unbalanced_ring_leans_by_its_tolerance(scene):
    """Where weight and the energy of all pairs of ring magnets, by another program, are least."""
    allowed = mm.theory.motor_tolerances(scene)
    places, outward = scene.inner_dipole_frame()
    outer, moments = scene.outer_sources()
    outer = outer - np.array([0, 0, scene.inner_height])
    beside = 0.1 * allowed.inner_center_of_mass

    def energy(angle):
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        a, b = scene.moment * (outward @ turn.T)[:, None], moments[None]
        arm = (places @ turn.T)[:, None] - outer[None]
        r = np.linalg.norm(arm, axis=2)
        along = (a * arm).sum(axis=2) * (b * arm).sum(axis=2)
        pairs = 1e-7 * ((a * b).sum(axis=2) / r**3 - 3 * along / r**5)
        return pairs.sum() - scene.inner_mass * 9.81 * beside * s

    size = 1e-3
    low, level, high = (energy(angle) for angle in (-size, 0.0, size))
    found = size / 2 * (low - high) / (low + high - 2 * level)
    assert found == pytest.approx(0.1 * allowed.ring_lean, rel=0.01)  # 0.0019


def test_the_level_ring_needs_the_same_pole_outward():
    """With the inner magnets inward, its stiffness has the other sign; no balance helps."""
    flipped = DESK.replace(inner_dipole_angle=math.pi)
    assert ring_stiffness(flipped) == pytest.approx(-ring_stiffness(DESK), rel=1e-9)
    assert ring_stiffness(DESK) > 0.4  # 0.47
    assert mm.theory.motor_tolerances(flipped).inner_center_of_mass == 0


def test_rolling_friction_takes_a_barrier_in_each_turn():
    """The ball turns by the length of the valley over its radius."""
    torque = mm.theory.motor_tolerances(DESK).rolling_friction * DESK.ball_mass * 9.81
    turned = 2 * math.pi * motor_wells(DESK).radius / DESK.ball_radius
    assert torque * turned == pytest.approx(motor_wells(DESK).barrier, rel=1e-12)


def test_the_center_of_mass_rises_by_a_barrier():
    """As the ball turns about its axis, which is as in the resting ball."""
    scene = mm.Motor()
    beside = mm.theory.motor_tolerances(scene).center_of_mass
    _, axis = mm.theory.resting_ball(scene)
    across = np.linalg.svd(axis[None])[2][1:]
    turn = np.linspace(0, 2 * math.pi, 721)
    heights = beside * (np.cos(turn) * across[0, 2] + np.sin(turn) * across[1, 2])
    rises = scene.ball_mass * 9.81 * np.ptp(heights)
    assert rises == pytest.approx(motor_wells(scene).barrier, rel=3e-4)  # 1e-5


def test_a_held_path_moves_the_plate_as_predicted():
    """400 replicas: the standard error of a root mean square is 3.5 % at most."""
    shaking, step = mm.theory.plate_shaking(DESK), 0.01
    path = mm.noise.BrownianPath(seed=3, timestep=step).held(5, 20)
    noise, friction = DESK.noises[0], DESK.friction_ball
    moved = np.array([path.increments(3000, replica=k) for k in range(400)]) * noise / friction
    places = np.cumsum(moved, axis=1)
    assert np.std(moved / step) == pytest.approx(shaking.speed(0.05), rel=0.03)  # 0.002
    assert np.std(places[:, 250]) == pytest.approx(shaking.stroke(1.0), rel=0.14)
    about_mean = places[:, 20:] - places[:, 20:].mean(axis=1, keepdims=True)
    expected = shaking.stroke(1.0) / math.sqrt(2)
    assert np.std(about_mean) == pytest.approx(expected, rel=0.06)  # 0.019, 29 s being short
    assert shaking.density == pytest.approx(2 * DESK.kT / friction, rel=1e-12)
    damper = mm.theory.damper_shaking(DESK)
    assert damper.density == pytest.approx(2 * DESK.kT / DESK.frictions[-1], rel=1e-12)


def test_the_magnet_on_the_axis_changes_the_barrier_as_predicted():
    """Against energies by another program, at the directions of a well and of a saddle."""
    found = mm.theory.axis_magnet(DESK, moment=0.5, coil_radius=0.01, turns=100, hold=0.3)
    places, moments = DESK.ring_sources()
    places = np.vstack([places, [0, 0, DESK.inner_height]])
    upward = [0, 0, math.sqrt(2) * 0.5]
    energies = around(DESK, (places, np.vstack([moments, upward])))
    barrier = np.ptp(energies)
    assert barrier == pytest.approx(found.barrier, rel=0.003)  # 3e-4
    assert barrier < 0.97 * motor_wells(DESK).barrier  # 0.952


def test_coils_turn_a_magnet_on_the_axis_but_not_the_ring():
    """Fields by Biot and Savart; a uniform field exerts no torque on outward dipoles."""
    found = mm.theory.axis_magnet(DESK, moment=0.5, coil_radius=0.01, turns=100, hold=0.04)
    angle = 2 * math.pi * np.arange(400) / 400
    loop = 0.01 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    along = 0.01 * 2 * math.pi / 400 * np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    field = 0.0
    for height in (-0.005, 0.005):
        arm = -loop - np.array([0, 0, height])
        part = np.cross(along, arm) / np.linalg.norm(arm, axis=1)[:, None] ** 3
        field += 1e-7 * 100 * found.current * part.sum(axis=0)[2]
    assert field == pytest.approx(found.field, rel=1e-9)
    assert found.torque == pytest.approx(0.5 * found.field)
    assert found.torque**2 * 0.04 == pytest.approx(2 * DESK.kT * DESK.frictions[-1])
    _, outward = DESK.inner_dipole_frame()
    assert np.abs(np.cross(outward, [1.0, 2.0, 3.0]).sum(axis=0)).max() < 6e-14  # 2e-15


def test_turning_about_its_own_axis_hardly_changes_the_potential():
    """By half of the distance of two magnets, in barriers, at the bottom of a well."""
    positions, moments = DESK.ring_sources()
    inner = (np.arange(25) < 20)[:, None]
    c, s = math.cos(math.pi / 20), math.sin(math.pi / 20)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    point = np.array([motor_wells(DESK).radius, 0.0, DESK.ball_radius])
    fields = [
        np.linalg.norm(mm.dipoles.field(point, positions, moments)),
        np.linalg.norm(
            mm.dipoles.field(
                point,
                np.where(inner, positions @ turn.T, positions),
                np.where(inner, moments @ turn.T, moments),
            )
        ),
    ]
    change = DESK.moment * abs(fields[1] - fields[0])
    assert 0 < change < 0.01 * motor_wells(DESK).barrier  # 0.0019


def test_dry_friction_on_a_circling_plate_is_viscous():
    """The mean of Coulomb's unit force over the circle is V/(2u), with an error of (V/u)^2/8."""
    angle = 2 * math.pi * np.arange(1000) / 1000
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for slip in (0.01, 0.1, 0.4):
        velocity = circle + np.array([slip, 0])
        force = (velocity / np.linalg.norm(velocity, axis=1)[:, None]).mean(axis=0)
        assert force[0] / (slip / 2) - 1 == pytest.approx(slip**2 / 8, rel=0.15)  # 0.09
        assert abs(force[1]) < 1e-13


def test_an_oil_film_resists_rolling_more_than_slip():
    """By Reynolds' equation: 0.8 and 1/3 of the logarithm of radius over thickness, over 6 pi.

    With the radius and the viscosity as units, the pressure is P(s) rho cos(phi), s = log rho,
    and (rho H^3 P')'/rho - H^3 P/rho^2 = -6 rho (v + omega); U = v - omega is the slip.
    """
    found = []
    for thickness in (1e-6, 1e-7):
        s = np.linspace(math.log(1e-3 * thickness**0.5), 0.0, 4001)
        rho, step = np.exp(s), s[1] - s[0]
        film = thickness + rho**2 / 2
        between = thickness + rho[:-1] * rho[1:] / 2
        band = np.zeros((3, len(s)))
        band[0, 1:], band[2, :-1] = between**3, between**3
        band[1, 1:-1] = -(between[1:] ** 3 + between[:-1] ** 3) - step**2 * film[1:-1] ** 3
        band[1, [0, -1]], band[0, 1], band[2, -2] = 1.0, 0.0, 0.0
        right = -6 * rho**3 * step**2
        right[[0, -1]] = 6 / 5 * rho[[0, -1]] / film[[0, -1]] ** 2
        pressure = solve_banded((1, 1), band, right)
        by_pressure = math.pi / 2 * trapezoid(pressure * rho**3, s)
        by_shear = 2 * math.pi * trapezoid(rho**2 / film, s)
        rolls = 2 * 2 * by_pressure  # v = omega = 1: dissipation F v + T omega
        found.append((by_shear / (6 * math.pi), rolls / (6 * math.pi)))
    slip, rolling = np.diff(found, axis=0)[0] / math.log(10)
    assert slip == pytest.approx(1 / 3, rel=1e-3)
    assert rolling == pytest.approx(0.8, rel=1e-3)


def test_the_page_of_devices_has_these_numbers():
    """The rows of the table that compares the paper's motor with the desk motor."""
    page = Path(__file__).parents[2] / "docs" / "paper_devices.md"
    text = page.read_text(encoding="utf-8")
    scenes = mm.Motor(), DESK
    moments = scenes[0].moment, DESK.bill_of_materials("N42").ball_moment
    barriers = [motor_wells(scene).barrier for scene in scenes]
    tilts = [1e6 * mm.theory.motor_tolerances(scene).floor_tilt for scene in scenes]
    reversals = [40e-6 * m / e for m, e in zip(moments, barriers, strict=True)]
    rows = [
        [f"{s.inner_radius:.3g}, {s.outer_radius:.3g}" for s in scenes],
        [
            f"{1e3 * s.ball_radius:.3g}, {1e3 * s.ball_mass:.0f}, {m:.1f}"
            for s, m in zip(scenes, moments, strict=True)
        ],
        [f"{scenes[0].units.time:.0f}", f"{DESK.units.time:.1f}"],
        [
            f"{1e6 * s.kT:#.2g}, {1e6 * e:#.2g}".replace(".,", ",").rstrip(".")
            for s, e in zip(scenes, barriers, strict=True)
        ],
        [f"{s.friction_ball:.2g}, {s.frictions[-1]:.2g}" for s in scenes],
        [f"{tilts[0]:.2f} µrad", f"{tilts[1]:.0f} µrad"],
        [f"{reversals[0]:.0f}", f"{reversals[1]:.1f}"],
    ]
    for paper, desk in rows:
        assert f" | {paper} | {desk} |\n" in text


def test_slip_on_a_circling_plate_relaxes_as_with_viscous_friction():
    """Two balls on the page's plate at 50 Hz, by Runge-Kutta: their difference decays like slip."""
    mobility = mm.theory.slip_mobility(DESK)
    weight, rate = DESK.weight, 2 * math.pi * 50
    speed = 0.2 * weight / (2 * DESK.friction_ball)

    def slope(slips, time):
        over_plate = slips - speed * np.array([math.cos(rate * time), math.sin(rate * time)])
        return -mobility * 0.2 * weight * over_plate / np.linalg.norm(over_plate, axis=1)[:, None]

    slips, step, turn = np.array([[0.0, 0.0], [0.01, 0.0]]), 1e-4, 200
    apart = []
    for k in range(8 * turn):
        now = k * step
        first = slope(slips, now)
        second = slope(slips + step / 2 * first, now + step / 2)
        third = slope(slips + step / 2 * second, now + step / 2)
        fourth = slope(slips + step * third, now + step)
        slips = slips + step / 6 * (first + 2 * second + 2 * third + fourth)
        apart.append(np.linalg.norm(slips[1] - slips[0]))
    decay = math.log(apart[2 * turn] / apart[-1]) / ((6 * turn - 1) * step)
    assert decay == pytest.approx(DESK.friction_ball * mobility, rel=0.08)  # 0.036


def test_tolerances_are_those_of_a_level_motor_and_positive():
    level = mm.theory.motor_tolerances(DESK)
    tilted = DESK.replace(floor_tilt=(1e-3, 0.0), background_field=(1e-4, 0.0, 0.0))
    assert mm.theory.motor_tolerances(tilted) == level
    inward = mm.theory.motor_tolerances(DESK.replace(inner_dipole_angle=math.pi))
    assert min(inward._replace(inner_center_of_mass=1.0)) > 0  # 0 where the ring is unstable
