"""Energy of the motor, magnetic lift on its ball, energy balance and efficiency."""

import warnings
from typing import NamedTuple

import numpy as np
import xarray as xr

from magmotor.common.arrays import Array
from magmotor.device.analysis import OWN, analysis
from magmotor.device.observable import labeled
from magmotor.devices.ball.rigid_forces import force_and_field
from magmotor.devices.ball.scene import gravitational_energy
from magmotor.devices.ball.states import axes
from magmotor.devices.motor.observables import azimuth
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.states import MotorStates
from magmotor.devices.motor.theory import ball_injection_rate, ring_injection_rate
from magmotor.devices.motor.variational import magnets
from magmotor.dipoles import NOBODY
from magmotor.numerics.batch_means import BATCHES, mean_and_error
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.rotations import columns, dot, place_dipoles

LABELS = {
    "gain": ("J", "change of the total energy"),
    "heat": ("J", "heat dissipated by friction"),
    "work": ("J", "work of the noise"),
    "injected": ("J", "mean work of the noise"),
    "martingale": ("J", "work of the noise minus its mean"),
    "load_work": ("J", "work of the load"),
    "residual": ("J", "residual of the energy balance"),
    "kicks": ("J", "work of the noise on the ring"),
    "transferred": ("J", "work transferred to the ball"),
    "reached": ("J", "work that has reached the ball"),
    "efficiency": ("1", "efficiency"),
    "share": ("1", "share of the work on the ring that has reached the ball"),
}
"""Units and labels of the variables of `motor_energy_balance` and `efficiency`."""


LARGEST_SHARE = 0.1
"""Share of what is exchanged that a method may add to the energy, or lose, without a warning."""

ROUNDED = 1e-9
"""Share of the energy below which a drift may be one of rounding errors."""

FALSE_ALARMS = 0.01
"""Largest probability by Student's law of a drift that the spread of the replicas alone explains:
three standard errors of 16 replicas."""

SIGNIFICANT = 5
"""The same in standard errors of batches in time, which are not independent."""


class MotorEnergy(NamedTuple):
    """Energies in J and the lift in N, each of shape (T, replicas).

    `ring` is the kinetic energy of the inner ring plus its energy in the field of the outer ring;
    `wobble` is its kinetic energy without that of the rotation about its axis.
    """

    total: Array
    ring: Array
    wobble: Array
    lift: Array
    """Vertical magnetic force on the ball."""


def motor_energy(scene: Motor, states: MotorStates) -> MotorEnergy:
    """Compute total energy E, energy of the inner ring, and lift; U is that of the Lagrangian.

    The energy of ball and inner ring is multiplied by `ball_ring_factor`; gravity is zero when the
    ball is on a level plane.
    """
    axis, ring_axis = axes(states.orientation), axes(states.ring_orientation)
    shape = states.position.shape[:-1]
    magnetic = np.empty((3, states.position[..., 0].size))
    _magnetic()(
        magnetic,
        np.ascontiguousarray(states.position).reshape(-1, 3),
        scene.moment * axis.reshape(-1, 3),
        np.ascontiguousarray(states.ring_orientation).reshape(-1, 4),
        magnets(scene),
    )
    on_ball, on_ring, lift = magnetic.reshape(3, *shape)
    across, _, axial = scene.inner_moments
    spin = states.ring_angular_velocity
    about = np.sum(spin * ring_axis, axis=-1)
    wobble = 0.5 * across * (np.sum(spin**2, axis=-1) - about**2)
    ring = wobble + 0.5 * axial * about**2 + on_ring
    translation = scene.ball_mass * np.sum(states.velocity**2, axis=-1)
    rotation = scene.ball_inertia * np.sum(states.angular_velocity**2, axis=-1)
    ball = 0.5 * (translation + rotation) + gravitational_energy(scene, states.position)
    return MotorEnergy(ball + on_ball + ring, ring, wobble, lift)


@compiled_once(nogil=True, error_model="numpy")
def _magnetic(checksum: int):
    """Compile the loop over states."""

    def magnetic(out, position, moment, ring_orientation, magnets):
        _ = checksum
        fixed, factor = magnets.fixed, magnets.factor
        ring = magnets.frame.copy()
        for i in range(len(position)):
            w, x, y, z = ring_orientation[i]
            place_dipoles(ring, columns((w, x, y, z)), (0.0, 0.0, magnets.height), magnets.frame)
            place = position[i, 0], position[i, 1], position[i, 2]
            m = moment[i, 0], moment[i, 1], moment[i, 2]
            near, nearby = force_and_field(place, m, ring)
            far, far_field = force_and_field(place, m, fixed)
            out[0, i] = -factor * dot(m, nearby) - dot(m, far_field) - dot(m, magnets.background)
            out[1, i] = 0.0
            out[2, i] = factor * near[2] + far[2]
            for j in range(fixed.shape[1]):
                if fixed[6, j] != NOBODY:
                    x, y, z, mx, my, mz, _label = fixed[:, j]
                    _force, field = force_and_field((x, y, z), (mx, my, mz), ring)
                    out[1, i] -= dot((mx, my, mz), field)

    return magnetic


@analysis("energy", "heat", "work", of=Motor)
def motor_energy_balance(run: xr.Dataset, scene: Motor = OWN) -> xr.Dataset:
    """Compare the energy with heat and with the work of the noise and of the load.

    By the paper's remarks, dE = (-c_B |V_Q|^2 - c_R |omega_R|^2) dt + r dt + martingale, with the
    rate r = alpha_B^2 (1/m + r^2/J_B) + (alpha_R^2/2) tr(I_R^-1); at non-uniform temperature c_R
    and alpha_B are zero. The last two terms together are the Stratonovich work of the noise.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`; the interval between records does not matter unless there is a load.
    scene : Motor, optional
        The scene of the run; by default the one in its attributes.

    Returns
    -------
    xarray.Dataset
        In J since the first record: `gain` = E - E(0), `heat`, `work`, `injected` = r t, for white
        noise, `martingale` = work - injected, `load_work`, the load's torque times the azimuth that
        the ball has gained, and `residual` = gain + heat - work - load_work.

    Raises
    ------
    ValueError
        There is a load, and the azimuth is ambiguous; see `azimuth`.
    """
    elapsed = run.time - run.time[0]
    rate = ball_injection_rate(scene) + ring_injection_rate(scene)
    injected = (rate * elapsed).broadcast_like(run.work).transpose(*run.work.dims)
    gain, heat, work = map(_since_start, (run.energy, run.heat, run.work))
    load_work = _work_of_load(run, scene)
    data = {
        "gain": gain,
        "heat": heat,
        "work": work,
        "injected": injected,
        "martingale": work - injected,
        "load_work": load_work,
        "residual": gain + heat - work - load_work,
    }
    return labeled(xr.Dataset(data), LABELS)


def check_first_law(run: xr.Dataset, scene: Motor) -> None:
    """Warn if a finished run's energy, heat and work drift apart by more than a small share.

    Between two temperatures the share is that of the heat from either bath, else of all heat and
    work, and of the ball's energy. The drift must exceed about three standard errors of the
    replicas (more if they are fewer than 16) or five of a mean over 16 batches in time or more, as
    for a single run. Nothing is said of a single run of at most 16 records, nor if the work of a
    load is ambiguous.

    Warns
    -----
    UserWarning
        The method has created or destroyed energy.
    """
    try:
        residual = motor_energy_balance(run, scene).residual.values
    except ValueError:  # too few records to tell which way the ball has gone under its load
        return
    lost, heat, work = float(np.mean(residual[..., -1])), run.heat.values, run.work.values
    from_ring = run.ring_work.values - run.ring_heat.values
    if scene.has_two_temperatures:
        each = (from_ring, work - heat - from_ring)
        scale = max(abs(float(np.mean(gained[..., -1] - gained[..., 0]))) for gained in each)
    else:
        scale = float(np.mean((abs(heat) + abs(work))[..., -1]))
        scale += float(np.abs(run.energy.values - run.ring_energy.values).max())
    energy = float(np.abs(run.energy.values).max())
    scale = scale or energy  # nothing is exchanged, and the ball has no energy
    least = max(LARGEST_SHARE * scale, ROUNDED * energy)
    if abs(lost) > least and _is_significant(residual):
        exchanged = "the heat" if scene.has_two_temperatures else "heat, work and energy"
        warnings.warn(
            f"timestep = {run.attrs['timestep']:g}: {run.attrs['method']} has"
            f" {'added' if lost > 0 else 'lost'} {abs(lost):.2g} J, {abs(lost) / scale:.0%} of"
            f" {exchanged}, so that the first law does not hold: use a shorter timestep",
            stacklevel=7,  # the caller of simulate
        )


def _is_significant(residual: Array) -> bool:
    """Return whether a residual, shape (T,) or (replicas, T), drifts by its standard errors."""
    from scipy.special import stdtrit

    rows = np.atleast_2d(residual)
    replicas, records = rows.shape
    if replicas > 1:
        limit = stdtrit(replicas - 1, 1 - FALSE_ALARMS / 2) / np.sqrt(replicas)
        if abs(rows[:, -1].mean()) > limit * rows[:, -1].std(ddof=1):
            return True
    if records <= BATCHES:
        return False
    drift, error = mean_and_error(np.diff(rows))
    return abs(drift) > SIGNIFICANT * error


@analysis("energy", "ring_energy", "heat", "ring_heat", "work", "ring_work", of=Motor, finite=False)
def efficiency(run: xr.Dataset, scene: Motor = OWN) -> xr.Dataset:
    """Compute the paper's efficiency: work transferred to the top over work of the kicks.

    Where the paper is ambiguous, we define:

    - The work of the kicks on the ring is the Stratonovich integral of alpha dW . omega_R. The
      factor alpha occurs once; the paper's formula has it both in T_R and before the integral.
    - The energy of the ring is its kinetic energy plus its energy in the field of the outer ring.
      Total energy minus ring energy is the energy of the ball, including its interaction with the
      inner ring.
    - The work of T_R equals the change of the total energy only without friction. The transferred
      work as the paper writes it is a change of energy and omits the heat that the ball's friction
      has dissipated, which over long times is nearly all of it. `share` includes this heat: it is
      the fraction of the kicks' work that has reached the ball. It does not include the work of the
      noise on the ball itself. At uniform temperature its sign may therefore vary, and it tends to
      zero, since on average no heat flows between two bodies of equal temperature. The residual of
      the energy balance is part of it.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`; the efficiency is computed at each record.
    scene : Motor, optional
        The scene of the run; by default the one in its attributes.

    Returns
    -------
    xarray.Dataset
        In J since the first record: `kicks`, the work on the ring, `transferred` = (E - E(0)) -
        (E_ring - E_ring(0)), and `reached` = transferred + heat of the ball - work of the noise and
        of the load on the ball. Dimensionless: `efficiency` = transferred/kicks and `share` =
        reached/kicks, NaN where the work on the ring is zero, as in the first record.
    """
    kicks = _since_start(run.ring_work)
    transferred = _since_start(run.energy - run.ring_energy)
    dissipated = _since_start((run.heat - run.ring_heat) - (run.work - run.ring_work))
    reached = transferred + dissipated - _work_of_load(run, scene)
    moved = kicks.where(kicks != 0)
    data = {
        "kicks": kicks,
        "transferred": transferred,
        "reached": reached,
        "efficiency": transferred / moved,
        "share": reached / moved,
    }
    return labeled(xr.Dataset(data), LABELS)


def _work_of_load(run: xr.Dataset, scene: Motor) -> xr.DataArray:
    """Return the work of the load in J since the first record."""
    if not scene.load_torque:
        return xr.zeros_like(run.energy)
    return scene.load_torque * _since_start(azimuth(run))


def _since_start(values: xr.DataArray) -> xr.DataArray:
    """Subtract the first record."""
    return values - values.isel(time=0, drop=True)
