"""`mm.advise`: errors against closed forms and plain loops, limits, chaos, floors, bad input."""

import math

import mujoco
import numpy as np
import pytest

import magmotor as mm

OMEGA = 10.0

OSCILLATOR = """
<mujoco>
  <option gravity="0 0 0" timestep="0.004"/>
  <worldbody><body><joint name="slide" type="slide" stiffness="100"/><geom size="0.1" mass="1"/></body></worldbody>
</mujoco>
"""

PENDULUM = """
<mujoco>
  <option timestep="0.005"/>
  <worldbody>
    <body>
      <joint name="one" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
      <body pos="0 0 -.5">
        <joint name="two" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def started(xml, qpos=(), qvel=()):
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qpos[: len(qpos)] = qpos
    data.qvel[: len(qvel)] = qvel
    return model, data


@pytest.fixture(scope="module")
def oscillator():
    return mm.advise(*started(OSCILLATOR, [0.1]), quantity="joint slide", duration=2.0)


def test_errors_of_an_oscillator_are_those_of_the_closed_form(oscillator):
    def error(integrator, h):
        model, data = started(OSCILLATOR, [0.1])
        model.opt.timestep, model.opt.integrator = h, getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        worst = 0.0
        for _ in range(round(oscillator.duration / h)):
            mujoco.mj_step(model, data)
            worst = max(worst, abs(data.qpos[0] - 0.1 * math.cos(OMEGA * data.time)))
        return worst / 0.2

    compared = 0
    for point in oscillator.points:
        truth = error(point.integrator, point.timestep)
        if 1e-8 < truth < 0.3:
            assert point.error == pytest.approx(truth, rel=0.1), point
            compared += 1
    assert compared > 10
