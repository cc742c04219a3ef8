"""Theory: closed forms for all scenes, and the reduced equation of the sliding disk."""

from magmotor.device.step_limits import small_motion
from magmotor.devices.ball.resting import resting_ball
from magmotor.devices.ball.slip import eddy_drag
from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.theory.closed_forms import (
    ballistic_coefficient,
    flat_x_diffusion,
    heat_rate,
    injection_rate,
    velocity_noise_coefficient,
    y_diffusion,
)
from magmotor.devices.disk.theory.curves import DiskTheory
from magmotor.devices.disk.theory.flat import (
    flat_mean_displacement,
    flat_msd_from_gibbs,
    flat_variance_from_rest,
)
from magmotor.devices.disk.theory.fokker_planck import ReducedDisk, d_diffusion
from magmotor.devices.disk.theory.stationary import (
    friction_rates,
    gibbs_deviations,
    gibbs_mean_squares,
    position_cdf,
    position_density,
    slip_factor,
    slip_rate,
    temperature,
)
from magmotor.devices.disk.theory.timesteps import (
    alias_period,
    euler_slip_variance,
    friction_step_limit,
    largest_timestep,
    potential_step_limit,
)
from magmotor.devices.motor.shaking import axis_magnet, damper_shaking, plate_shaking
from magmotor.devices.motor.theory import ball_injection_rate, ring_injection_rate, slip_mobility
from magmotor.devices.motor.tolerances import motor_tolerances
from magmotor.devices.top.theory import (
    field_under_center,
    highest_valley,
    libration_frequency,
    slip_relaxation_rate,
)
from magmotor.numerics.linear_stability import SmallMotion, largest_stable_step, spectral_radius

__all__ = [
    "DiskTheory",
    "ReducedDisk",
    "SmallMotion",
    "alias_period",
    "axis_magnet",
    "ball_injection_rate",
    "ballistic_coefficient",
    "d_diffusion",
    "damper_shaking",
    "eddy_drag",
    "euler_slip_variance",
    "field_under_center",
    "flat_mean_displacement",
    "flat_msd_from_gibbs",
    "flat_variance_from_rest",
    "flat_x_diffusion",
    "friction_rates",
    "friction_step_limit",
    "gibbs",
    "gibbs_deviations",
    "gibbs_mean_squares",
    "heat_rate",
    "highest_valley",
    "injection_rate",
    "largest_stable_step",
    "largest_timestep",
    "libration_frequency",
    "motor_tolerances",
    "plate_shaking",
    "position_cdf",
    "position_density",
    "potential_step_limit",
    "resting_ball",
    "ring_injection_rate",
    "slip_factor",
    "slip_mobility",
    "slip_rate",
    "slip_relaxation_rate",
    "small_motion",
    "spectral_radius",
    "temperature",
    "velocity_noise_coefficient",
    "y_diffusion",
]
