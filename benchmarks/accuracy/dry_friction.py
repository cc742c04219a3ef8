"""The top under dry friction: how far MuJoCo's runs are from Coulomb's law in the paper's equation.

The reference adds Coulomb's law to the planar equation of an isotropic ball. The friction is the
force that would stop the slip at `RATE`, but at most the coefficient times weight minus lift; while
it is below that, the ball sticks without creep.

It shares only the sum over the dipoles with the run. That is sound because the tests compare the
sum with magpylib, and the errors measured here are those of friction, contact and time stepping.
"""

from functools import cache, partial

import numpy as np
import xarray as xr
from numba import njit
from scipy.integrate import solve_ivp

import magmotor as mm
from benchmarks.accuracy.top import largest_error
from benchmarks.harness.records import Case, Record
from magmotor.dipoles import NOBODY, pack_sources, sum_over_sources

RATE = 2000.0
"""In 1/s. With 2e4 instead, J changes by at most 5e-4 of its largest value."""

TOLERANCE = 1e-10

METHOD, DURATION = "mujoco/euler", 60.0
NUMBERS = (250, 1000)
"""Steps per second."""

COEFFICIENTS = {0.0: (1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 1.0), 0.3: (3e-4, 3e-3, 0.1)}
"""Coulomb coefficients, by the viscous friction beside them in kg/s."""


def cases(quick: bool) -> list[Case]:
    """Return a case for each pair of frictions."""
    chosen = {0.0: (3e-3, 0.1)} if quick else COEFFICIENTS
    return [
        Case(f"dry friction/{coulomb:g}/{viscous:g}", partial(_measure, coulomb, viscous), 8.0)
        for viscous, coefficients in chosen.items()
        for coulomb in coefficients
    ]


def _measure(coulomb: float, viscous: float) -> Record:
    scene = mm.Top(surface="plane", coulomb_friction=coulomb, friction=viscous)
    errors = [error(scene, METHOD, 1 / number, DURATION) for number in NUMBERS]
    return {"coulomb": coulomb, "viscous": viscous, "dry_errors": errors}


def error(
    scene: mm.Top, method: str, timestep: float, duration: float, rate: float = RATE
) -> float:
    """Return the largest error of J along a run, relative to the largest J."""
    run = mm.simulate(
        scene, method=method, timestep=timestep, duration=duration,
        record_interval=round(0.02 / timestep),
    )  # fmt: skip
    truth = momentum_map(scene, duration, rate).values
    return largest_error(run.momentum_map.values, truth, truth)


@cache
def momentum_map(scene: mm.Top, duration: float, rate: float) -> xr.DataArray:
    """Return the reference's J, in kg m^2/s, every 0.02 s."""
    inertia, mass, radius = scene.inertia[0], scene.ball_mass, scene.ball_radius
    times = 0.02 * np.arange(round(duration / 0.02) + 1)
    axis = np.array(scene.axis) / np.linalg.norm(scene.axis)
    state = np.concatenate([scene.position, scene.velocity, axis, inertia * scene.spin * axis])
    numbers = (scene.friction, scene.coulomb_friction, rate, radius, mass, inertia, scene.moment)
    parameters = (*numbers, scene.weight)
    rows = solve_ivp(
        _derivative, (0, times[-1]), state, method="DOP853", t_eval=times, max_step=0.05,
        rtol=TOLERANCE, atol=1e-3 * TOLERANCE,
        args=(pack_sources(*scene.ring_sources()), parameters),
    ).y  # fmt: skip
    return xr.DataArray(np.sum(rows[4:7] * rows[7:10], axis=0), {"time": times})


@njit
def _derivative(_, y, sources, parameters):
    viscous, coulomb, rate, r, m, inertia, moment, weight = parameters
    vx, vy, (ax, ay, az) = y[2], y[3], y[4:7]
    wx, wy, wz = y[7] / inertia, y[8] / inertia, y[9] / inertia
    fx, fy, lift, bx, by, bz, _ = sum_over_sources(
        (y[0], y[1], r, moment * ax, moment * ay, moment * az), NOBODY, sources, sources.shape[1]
    )
    tx, ty, tz = (
        moment * (ay * bz - az * by),
        moment * (az * bx - ax * bz),
        moment * (ax * by - ay * bx),
    )
    mobility = 1 / m + r * r / inertia
    slip_x, slip_y = vx - r * wy, vy + r * wx
    gain_x = fx / m - r * ty / inertia - viscous * mobility * slip_x
    gain_y = fy / m + r * tx / inertia - viscous * mobility * slip_y
    dry_x, dry_y = -(rate * slip_x + gain_x) / mobility, -(rate * slip_y + gain_y) / mobility
    held = coulomb * (weight - lift) / max(np.hypot(dry_x, dry_y), 1e-300)
    dry_x, dry_y = min(1.0, held) * dry_x, min(1.0, held) * dry_y
    qx, qy = dry_x - viscous * slip_x, dry_y - viscous * slip_y
    return np.array(
        [
            vx,
            vy,
            (fx + qx) / m,
            (fy + qy) / m,
            wy * az - wz * ay,
            wz * ax - wx * az,
            wx * ay - wy * ax,
            tx + r * qy,
            ty - r * qx,
            tz,
        ]
    )
