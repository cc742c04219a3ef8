"""What is measured of Langevin dynamics: the same estimates for this project and for the judges.

Each estimate is a pair: the mean over independent replicas, and its standard error.
"""

import math

import numpy as np

CORE = 1.0
"""Distance from a minimum at which a particle has arrived in its well, in rad."""


def of_particles(x, interval, lag):
    """Estimate motion in the potential -a cos x from positions of shape (replicas, records).

    A hop is the arrival in the core of another well than the last; `interval` is the time between
    records, and `lag` the number of records over which the diffusion is measured.
    """
    well = np.round(x / math.tau)
    inside = abs(x - math.tau * well) < CORE
    last = np.where(inside, np.arange(x.shape[1]), 0)
    last = np.take_along_axis(well, np.maximum.accumulate(last, axis=1), axis=1)
    hops = np.count_nonzero(np.diff(last, axis=1), axis=1) / (interval * (x.shape[1] - 1))
    moved = np.diff(x[:, ::lag], axis=1) ** 2 / (2 * lag * interval)
    return {
        "hopping rate": mean(hops),
        "diffusion": mean(moved.mean(axis=1)),
        "mean of cos x": mean(np.cos(x).mean(axis=1)),
    }


def of_bodies(v, omega, quaternion, *, mass, moments, lags):
    """Estimate the motion of free bodies.

    `v`, of shape (replicas, records, 3), is in the world frame, `omega` in the body's; quaternions
    have the order w, x, y, z. `lags` are numbers of records by their names.
    """
    turning = omega**2 * moments
    found = {"temperature of the center": mean(mass * (v**2).mean(axis=(1, 2)))}
    for axis in range(3):
        found[f"temperature about axis {axis + 1}"] = mean(turning[..., axis].mean(axis=1))
    frames = axes(quaternion)
    for name, lag in lags.items():
        found[f"m v(0).v({name})/3"] = mean(mass * _along(v, lag).mean(axis=1) / 3)
        for axis in range(3):
            spin = omega[..., axis] * math.sqrt(moments[axis])
            label = f"I omega(0) omega({name}), axis {axis + 1}"
            found[label] = mean((spin[:, :-lag] * spin[:, lag:]).mean(axis=1))
            kept = _along(frames[..., axis], lag).mean(axis=1)
            found[f"u(0).u({name}), axis {axis + 1}"] = mean(kept)
    return found


def axes(quaternion):
    """Return rotation matrices, whose columns are the body's axes, of shape (..., 3, 3)."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def mean(values):
    """Return the mean of independent values and its standard error."""
    return [float(values.mean()), float(values.std(ddof=1) / math.sqrt(len(values)))]


def _along(vectors, lag):
    return np.sum(vectors[:, :-lag] * vectors[:, lag:], axis=-1)


def coarse_areas(fine, timestep, factor):
    """Return W, H and K over coarse steps, from those over fine ones of shape (3, ..., steps).

    With the integral I of W(s) - W(t) over a step from t on, and the integral J of that integral,
    H = I/h - W/2 and K = J/h^2 - H/2 - W/6.
    """
    W, H, K = fine.reshape(*fine.shape[:-1], -1, factor)
    h = timestep
    I = h * (W / 2 + H)
    J = h**2 * (W / 6 + H / 2 + K)
    before = np.cumsum(W, axis=-1) - W
    grown = I + h * before
    area = np.cumsum(grown, axis=-1) - grown
    J = np.sum(J + h * area + h**2 / 2 * before, axis=-1)
    W, H = W.sum(axis=-1), grown.sum(axis=-1) / (h * factor)
    H -= W / 2
    return np.array([W, H, J / (h * factor) ** 2 - H / 2 - W / 6])
