"""Samples of the Metropolis algorithm against quadrature and closed forms.

Bounds are in standard errors by batch means over replicas. With a fixed seed, nothing is random;
for another seed, each bound of 4.5 would fail by chance once in 3000 (Student's t, 15 degrees of
freedom and more: fewer than one in 2000).
"""

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.numerics.batch_means import mean_and_error

SIGMAS = 4.5

ROD = '<geom type="capsule" fromto="0 0 0 0 0 -1" size="0.01" mass="1"/>'
DOUBLE = """
<mujoco>
  <worldbody>
    <body>
      <joint axis="0 1 0"/>
      <inertial pos="0 0 -0.5" mass="1" diaginertia="0.08333333333333333 0.08333333333333333 0.01"/>
      <body pos="0 0 -1">
        <joint name="knee" axis="0 1 0"/>
        <inertial pos="0 0 -0.5" mass="1"
                  diaginertia="0.08333333333333333 0.08333333333333333 0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
"""Two uniform rods of 1 m and 1 kg, whose moments of inertia at their centers are 1/12 kg m^2."""

GRAVITY = 9.81


def double_pendulum(kT, volume=True):
    """Return the means of cos q1, cos q2 and V by the trapezoidal rule over both angles.

    Without `volume`, the law has no root of det M = 4/9 - cos^2(q2)/4.
    """
    angles = np.linspace(-np.pi, np.pi, 400, endpoint=False)
    q1, q2 = np.meshgrid(angles, angles, indexing="ij")
    energy = -GRAVITY * (1.5 * np.cos(q1) + 0.5 * np.cos(q1 + q2))
    weight = np.exp(-(energy - energy.min()) / kT)
    if volume:
        weight *= np.sqrt(4 / 9 - np.cos(q2) ** 2 / 4)
    return [np.sum(weight * x) / np.sum(weight) for x in (np.cos(q1), np.cos(q2), energy)]


def deviations(series, truths):
    """Return the differences of means and truths in standard errors."""
    found = [mean_and_error(each) for each in series]
    print([(mean, error, truth) for (mean, error), truth in zip(found, truths, strict=True)])
    return [abs(mean - truth) / error for (mean, error), truth in zip(found, truths, strict=True)]


def test_double_pendulum():
    """Law with sqrt(det M); 16 x 5000 records."""
    model = mujoco.MjModel.from_xml_string(DOUBLE)
    run = mm.observables.metropolis(model, 5.0, samples=5000, replicas=16, seed=1, every=3)
    q1, q2 = run.qpos.values[..., 0], run.qpos.values[..., 1]
    series = [np.cos(q1), np.cos(q2), run.potential_energy.values]
    print(run)
    print(run.acceptance.values)
    print(deviations(series, double_pendulum(5.0)))
    print(deviations(series, double_pendulum(5.0, volume=False)))
