"""Temperatures of the motor's modes, with error bars from the means of batches."""

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from magmotor.common.checks import reject
from magmotor.common.hints import NotNegative
from magmotor.device.analysis import OWN, analysis
from magmotor.device.labels import labeled
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import slip_mobility

Array = NDArray[np.float64]

NEEDS = (
    *("position", "velocity", "slip_velocity", "momentum_map"),
    *("ring_orientation", "ring_angular_velocity"),
)

BATCHES, MOST = 16, 8
"""Runs are cut into pieces, `BATCHES` in all but at most `MOST` of each, whose means are taken
as independent.

A summed autocorrelation would tell the error of the fast modes more precisely. But that of the slow
ones oscillates, with the ball in its well, long before it decays, and every rule that tells where
to cut the sum then cuts it much too early.
"""

LABELS = {
    "temperature": ("J", "temperature of the mode"),
    "temperature_error": ("J", "standard error of the temperature"),
    "theory": ("J", "temperature kT of Gibbs' law"),
}


@analysis(*NEEDS, of=Motor)
def mode_temperatures(
    run: xr.Dataset, scene: Motor = OWN, burn_in: NotNegative = 0.0
) -> xr.Dataset:
    """Temperature of each mode, from its mean square velocity over times and replicas.

    At uniform temperature all are kT by Gibbs' law, whatever the potential:

    - radial: m <v_rho^2>, of the ball's motion to and from the center;
    - slip: <|V_Q|^2>/(2 A), A = 1/m + r^2/J_B, of the only motion that friction damps directly;
    - rolling: (m + J_B/r^2) <u_theta^2>, of the ball going round, where u = (m v + (J_B/r) omega x
      e_z)/(m + J_B/r^2), its velocity once slip has died out, has no friction: it is slow;
    - ring_1, ring_2, ring_3: I_i <w_i^2>, of the inner ring about its own axes;
    - spin: <J^2>/J_B, of the ball about its dipole, J = pi . xi_3; slow, too.

    The standard error is that of the mean over pieces, 16 in all but at most 8 of each run. It is
    too small where these are not long against the correlation time, some 1e4 s for rolling.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`.
    scene : Motor, optional
        Its scene; by default the one that the attributes of the run tell.
    burn_in : float
        Seconds to leave out at the beginning; rolling forgets a start from rest in some 2e4 s.

    Returns
    -------
    xarray.Dataset
        `temperature` and its standard error `temperature_error` in J, over `mode`; `theory`, kT in
        J, where the temperature is uniform.
    """
    late = run.isel(time=run.time >= run.time[0] + burn_in)
    if late.sizes["time"] < BATCHES:
        sentence = f"must be such that at least {BATCHES} records are left"
        raise reject("burn_in", burn_in, sentence)
    found = {name: mean_and_error(series) for name, series in _squares(late, scene).items()}
    columns: dict[str, Any] = {
        "temperature": ("mode", [mean for mean, _ in found.values()]),
        "temperature_error": ("mode", [error for _, error in found.values()]),
    }
    if scene.temperature == "uniform":
        columns["theory"] = ((), scene.kT)
    return labeled(xr.Dataset(columns, {"mode": [*found]}), LABELS)


def mean_and_error(series: Array) -> tuple[float, float]:
    """Mean of stationary series, shape (T,) or (replicas, T), and its standard error."""
    rows = np.atleast_2d(series)
    pieces = min(MOST, -(-BATCHES // len(rows)))
    batches = np.array([part.mean(axis=1) for part in np.array_split(rows, pieces, axis=1)])
    return float(rows.mean()), float(batches.std(ddof=1) / np.sqrt(batches.size))


def _squares(run: xr.Dataset, scene: Motor = OWN) -> dict[str, Array]:
    """For each mode, what has the mean kT at each record; shape (T,) or (replicas, T)."""
    position, velocity = run.position.values, run.velocity.values
    outward = position[..., :2] / np.linalg.norm(position[..., :2], axis=-1, keepdims=True)
    around = np.stack([-outward[..., 1], outward[..., 0]], axis=-1)
    rolling = scene.ball_inertia / scene.ball_radius**2
    inertia = scene.ball_mass + rolling
    # The slip is v - r omega x e_z, so that omega x e_z is (v - V_Q)/r.
    slip = run.slip_velocity.values[..., :2]
    rolled = velocity[..., :2] - rolling / inertia * slip
    turn = Rotation.from_quat(run.ring_orientation.values.reshape(-1, 4), scalar_first=True)
    ring = run.ring_angular_velocity.values
    ring = turn.apply(ring.reshape(-1, 3), inverse=True).reshape(ring.shape)
    about = zip(scene.inner_moments, np.moveaxis(ring, -1, 0), strict=True)
    return {
        "radial": scene.ball_mass * np.sum(velocity[..., :2] * outward, axis=-1) ** 2,
        "slip": np.sum(slip**2, axis=-1) / (2 * slip_mobility(scene)),
        "rolling": inertia * np.sum(rolled * around, axis=-1) ** 2,
        **{f"ring_{i}": moment * spin**2 for i, (moment, spin) in enumerate(about, 1)},
        "spin": run.momentum_map.values**2 / scene.ball_inertia,
    }
