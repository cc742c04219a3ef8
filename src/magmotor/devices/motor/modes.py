"""Temperatures of the motor's modes, with errors from batch means."""

from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import NotNegative
from magmotor.device.analysis import OWN, analysis
from magmotor.device.observable import labeled
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import slip_mobility
from magmotor.numerics.batch_means import BATCHES, mean_and_error

NEEDS = (
    *("position", "velocity", "slip_velocity", "momentum_map"),
    *("ring_orientation", "ring_angular_velocity"),
)

LABELS = {
    "temperature": ("J", "temperature of the mode"),
    "temperature_error": ("J", "standard error of the temperature"),
    "theory": ("J", "temperature kT of Gibbs' law"),
}


@analysis(*NEEDS, of=Motor)
def mode_temperatures(
    run: xr.Dataset, scene: Motor = OWN, burn_in: NotNegative = 0.0
) -> xr.Dataset:
    """Compute the temperature of each mode from its mean square velocity over time and replicas.

    At uniform temperature all are kT by Gibbs' law, for any potential:

    - radial: m <v_rho^2>, motion of the ball toward and away from the center;
    - slip: <|V_Q|^2>/(2 A), A = 1/m + r^2/J_B, the only mode of the ball that friction damps
      directly;
    - rolling: (m + J_B/r^2) <u_theta^2>, motion of the ball around the center. Here u = (m v +
      (J_B/r) omega x e_z)/(m + J_B/r^2) is the velocity after slip has decayed. This mode has no
      friction and is slow;
    - ring_1, ring_2, ring_3: I_i <w_i^2>, rotation of the inner ring about its principal axes;
    - spin: <J^2>/J_B, rotation of the ball about its dipole, J = pi . xi_3, also slow.

    The standard error is computed from the means of batches: 16 in total, but at most 8 for each
    replica. It is too small unless the batches are much longer than the correlation time, which is
    about 1e4 s for rolling.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`.
    scene : Motor, optional
        The scene of the run; by default the one in its attributes.
    burn_in : float
        Time in s to omit at the beginning; rolling takes about 2e4 s to forget a start from rest.

    Returns
    -------
    xarray.Dataset
        `temperature` and its standard error `temperature_error` in J, over `mode`; `theory`, kT in
        J, if the temperature is uniform.
    """
    late = run.isel(time=run.time >= run.time[0] + burn_in)
    if late.sizes["time"] < BATCHES:
        sentence = f"must leave at least {BATCHES} records"
        raise ArgumentError("burn_in", burn_in, sentence)
    found = {name: mean_and_error(series) for name, series in _squares(late, scene).items()}
    columns: dict[str, Any] = {
        "temperature": ("mode", [mean for mean, _ in found.values()]),
        "temperature_error": ("mode", [error for _, error in found.values()]),
    }
    if scene.temperature == "uniform":
        columns["theory"] = ((), scene.kT)
    return labeled(xr.Dataset(columns, {"mode": [*found]}), LABELS)


def _squares(run: xr.Dataset, scene: Motor = OWN) -> dict[str, Array]:
    """Return the instantaneous temperature of each mode, shape (T,) or (replicas, T)."""
    position, velocity = run.position.values, run.velocity.values
    outward = position[..., :2] / np.linalg.norm(position[..., :2], axis=-1, keepdims=True)
    around = np.stack([-outward[..., 1], outward[..., 0]], axis=-1)
    rolling = scene.ball_inertia / scene.ball_radius**2
    inertia = scene.ball_mass + rolling
    # V_Q = v - r omega x e_z, so that omega x e_z = (v - V_Q)/r.
    slip = run.slip_velocity.values[..., :2]
    rolled = velocity[..., :2] - rolling / inertia * slip
    rotation = Rotation.from_quat(run.ring_orientation.values.reshape(-1, 4), scalar_first=True)
    ring = run.ring_angular_velocity.values
    ring = rotation.apply(ring.reshape(-1, 3), inverse=True).reshape(ring.shape)
    about = zip(scene.inner_moments, np.moveaxis(ring, -1, 0), strict=True)
    return {
        "radial": scene.ball_mass * np.sum(velocity[..., :2] * outward, axis=-1) ** 2,
        "slip": np.sum(slip**2, axis=-1) / (2 * slip_mobility(scene)),
        "rolling": inertia * np.sum(rolled * around, axis=-1) ** 2,
        **{f"ring_{i}": moment * spin**2 for i, (moment, spin) in enumerate(about, 1)},
        "spin": run.momentum_map.values**2 / scene.ball_inertia,
    }
