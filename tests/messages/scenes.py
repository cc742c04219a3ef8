"""Fields of the scenes."""

import math

import magmotor as mm

TABLE = r"""
# Fields of a motor
>>> mm.Motor(ball_mass=-1)
ArgumentError: ball_mass = -1: must be greater than 0 kg
>>> mm.Motor(inner_dipole_angle=math.nan)
ArgumentError: inner_dipole_angle = nan: must be a finite number
>>> mm.Motor(inner_radius=1.0)
ArgumentError: inner_radius = 1.0: must be less than 0.98 m: otherwise the rings overlap

# Fields of a top
>>> fields = {"tilt": 4}
>>> mm.Top(**fields)
ArgumentError: tilt = 4: must be less than 1.5708 rad (4 degrees are 0.06981 rad)
"""
