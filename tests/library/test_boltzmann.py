"""Temperatures of positions and velocities that are drawn from known laws."""

import mujoco
import numpy as np
import pytest
import xarray as xr

import magmotor as mm

ARM = """
<mujoco>
  <worldbody>
    <body>
      <joint name="shoulder" type="ball"/>
      <geom type="box" size="0.1 0.2 0.3" pos="0.1 0.2 -0.3" density="200"/>
      <body pos="0 0 -0.6">
        <joint name="elbow" axis="0 1 0" armature="0.3" stiffness="20"/>
        <joint type="slide" axis="1 0 1" stiffness="300"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.1"/>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="a" body2="b"/></contact>
</mujoco>
""".replace("<body>", '<body name="a">').replace(
    '<body pos="0 0 -0.6"', '<body name="b" pos="0 0 -0.6"'
)


def drawn_velocities(model, positions, kT, random):
    """Return v = L^-T xi sqrt(kT) with M = L L^T, whose covariance is kT M^-1."""
    data = mujoco.MjData(model)
    matrix, unit = np.empty((model.nv, model.nv)), np.eye(model.nv)
    velocities = np.empty((*positions.shape[:-1], model.nv))
    for at in np.ndindex(positions.shape[:-1]):
        data.qpos[:] = positions[at]
        mujoco.mj_forward(model, data)
        for i in range(model.nv):
            mujoco.mj_mulM(model, data, matrix[i], unit[i])
        noise = np.sqrt(kT) * random.standard_normal(model.nv)
        velocities[at] = np.linalg.solve(np.linalg.cholesky(matrix).T, noise)
    return velocities


def test_kinetic():
    model = mujoco.MjModel.from_xml_string(ARM)
    run = mm.observables.metropolis(model, 2.0, samples=200, seed=1)
    random = np.random.default_rng(2)
    run["qvel"] = ("replica", "sample", "nv"), drawn_velocities(model, run.qpos.values, 2.0, random)
    print(mm.observables.kinetic_temperature(model, run))
    print(run.acceptance.mean("replica"))
