"""Statics of the top: lift and dry friction, checked by forces, energies and quadrature."""

import math

import numpy as np
import pytest

import magmotor as mm
from magmotor import dipoles
from paper.top.dry_friction import held_axis, hertz_torsional_coefficient
from paper.top.lift import critical_height, largest_lift, largest_lift_map, lift_map

RNG = np.random.default_rng(5)


def test_no_torque_rotates_the_axis_of_a_held_ball():
    scene = mm.Top()
    points = RNG.uniform(-0.2, 0.2, (20, 2))
    axis, force, energy = held_axis(scene, points)
    center = np.insert(points, 2, scene.ball_radius, axis=1)
    pull, torque = dipoles.wrench(center, scene.moment * axis, *scene.ring_sources())
    about = torque + np.cross([0.0, 0.0, scene.ball_radius], pull)
    across = about - np.sum(about * axis, axis=1, keepdims=True) * axis
    assert np.abs(across).max() < 1e-10 * np.abs(energy).max()  # 1e-11
    assert np.abs(force - pull).max() < 1e-9 * np.abs(pull).max()  # 7e-11


def test_torque_of_a_sliding_hertzian_contact():
    scene, modulus, friction = mm.Top(), 1e11, 0.4
    load = scene.ball_mass * scene.gravity
    radius = (0.75 * load * scene.ball_radius / modulus) ** (1 / 3)
    r = (np.arange(100_000) + 0.5) / 100_000
    pressure = 1.5 * load / (math.pi * radius**2) * np.sqrt(1 - r**2)
    torque = friction * np.mean(pressure * radius * r * 2 * math.pi * r) * radius**2
    coefficient = hertz_torsional_coefficient(scene, friction, modulus)
    assert coefficient == pytest.approx(torque / load, rel=2e-7, abs=0)  # 1.4e-8


def test_lift_is_the_gradient_of_the_energy():
    scene, points, step = mm.Top(), RNG.uniform(-0.4, 0.4, (50, 2)), 1e-6
    lift, axis = lift_map(scene, points)
    up, down = (
        dipoles.energy(
            np.insert(points, 2, scene.ball_radius + side, axis=1),
            scene.moment * axis,
            *scene.ring_sources(),
        )
        for side in (step, -step)
    )
    weight = scene.ball_mass * scene.gravity
    expected = (down - up) / (2 * step) / weight
    assert np.abs(lift - expected).max() < 1e-9 * np.abs(lift).max()  # 7e-11


def test_no_direction_of_the_axis_exceeds_the_largest_lift():
    scene, points = mm.Top(), RNG.uniform(-0.4, 0.4, (50, 2))
    bound = largest_lift_map(scene, points)
    axes = RNG.normal(size=(2000, 1, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    center = np.insert(points, 2, scene.ball_radius, axis=1)
    force = dipoles.wrench(center, scene.moment * axes, *scene.ring_sources())[0][..., 2]
    lifts = force.max(axis=0) / (scene.ball_mass * scene.gravity)
    assert np.all(lifts <= bound * (1 + 1e-12))
    assert np.all(lifts > 0.97 * bound)  # 0.99: one of 2000 is near the best


def test_at_the_critical_height_the_largest_lift_is_one():
    scene = mm.Top()
    at = largest_lift(scene.replace(ring_height=critical_height(scene)))
    assert at.aligned == pytest.approx(1.0, rel=2e-3)  # 1e-4
