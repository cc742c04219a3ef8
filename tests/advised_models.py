"""Models for the tests of `mm.advise`."""

import math
import time

import mujoco

from magmotor.advice.paths import Runs

OMEGA, AMPLITUDE = 10.0, 0.1
"""Of the oscillator."""

OSCILLATOR = """
<mujoco>
  <option gravity="0 0 0" timestep="0.004"/>
  <worldbody>
    <body><joint name="slide" type="slide" stiffness="100"/><geom size="0.1" mass="1"/></body>
  </worldbody>
</mujoco>
"""

_TWO_LINKS = """
<mujoco>
  <option timestep="0.005"/>
  <worldbody>
    <body>
      <joint name="one" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
      <body pos="0 0 -.5">
        <joint name="two" axis="0 1 0" stiffness="{}"/>
        <geom type="capsule" fromto="0 0 0 0 0 {}" size="{}"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
PENDULUM = _TWO_LINKS.format(0, -0.5, 0.02)
WHIP = _TWO_LINKS.format(0.15, -0.05, 0.01)

LEVITRON = f"""
<mujoco>
  <option timestep="0.001"/>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    {
    "".join(
        f'<site pos="{0.05 * math.cos(math.pi * k / 6)} {0.05 * math.sin(math.pi * k / 6)} 0"'
        ' user="16.866"/>'
        for k in range(12)
    )
}
    <body pos="0 0 0.088">
      <freejoint name="top"/>
      <inertial pos="0 0 0" mass="0.02" diaginertia="1.3e-6 1.3e-6 2.2e-6"/>
      <site zaxis="0 0 -1" user="0.5"/>
    </body>
  </worldbody>
</mujoco>
"""

BALL = """
<mujoco>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body pos="0 0 0.3"><freejoint name="ball"/><geom size="0.1"/></body>
  </worldbody>
</mujoco>
"""

TRAP = """
<mujoco>
  <size nuserdata="5"/>
  <option gravity="0 0 0" timestep="0.01"/>
  <custom><text name="magmotor" data="noise"/></custom>
  <worldbody>
    <body user="1 0 0 0 0 0">
      <joint name="slide" type="slide" axis="1 0 0" stiffness="20" damping="0.5"/>
      <geom size="0.1" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""

NEEDLE = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets"/></plugin></extension>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    <body>
      <joint name="needle" axis="0 0 1"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site zaxis="1 0 0" user="0.2"/>
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


class Clock:
    """Stands for `time.perf_counter`; a step takes as long as a test says, on any machine.

    Parameters
    ----------
    monkeypatch : pytest.MonkeyPatch
    step : float
        Time in s of a step of MuJoCo.
    """

    def __init__(self, monkeypatch, step):
        self.now, self.step = 0.0, step
        advance = Runs.advance

        def advanced(runs, steps):
            self.now += steps * self.step
            return advance(runs, steps)

        monkeypatch.setattr(time, "perf_counter", self)
        monkeypatch.setattr(Runs, "advance", advanced)

    def __call__(self):
        self.now += 1e-7
        return self.now
