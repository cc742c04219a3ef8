"""The paper's ODE of Hamel's top in NumPy, written for SciPy."""

import numpy as np

import magmotor as mm


def problem(scene: mm.Top):
    """Return the right-hand side and initial state of (x, v, xi_3, pi), for an isotropic ball."""
    positions, moments = scene.ring_sources()
    m, c, r, inertia = scene.ball_mass, scene.friction, scene.ball_radius, scene.inertia[0]
    flat, down = np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.0, -r])

    def derivative(t, y):
        velocity, axis, omega = np.append(y[2:4], 0.0), y[4:7], y[7:10] / inertia
        force, field = force_and_field(np.append(y[:2], r), scene.moment * axis, positions, moments)
        friction = -c * flat * (velocity + np.cross(omega, down))
        torque = np.cross(scene.moment * axis, field) + np.cross(down, friction)
        return np.concatenate([y[2:4], (force + friction)[:2] / m, np.cross(omega, axis), torque])

    start = [
        *scene.position,
        *scene.velocity,
        *scene.axis,
        *inertia * scene.spin * np.array(scene.axis),
    ]
    return derivative, np.array(start)


def force_and_field(position, moment, positions, moments):
    """Return the force on a dipole in the field of others, and that field."""
    r = position - positions
    d = np.linalg.norm(r, axis=1, keepdims=True)
    n = r / d
    mn, an = np.sum(moments * n, axis=1, keepdims=True), (n @ moment)[:, np.newaxis]
    field = np.sum((3 * mn * n - moments) / d**3, axis=0)
    bracket = an * moments + mn * moment + (moments @ moment)[:, np.newaxis] * n - 5 * an * mn * n
    return 3e-7 * np.sum(bracket / d**4, axis=0), 1e-7 * field
