"""Kinematic trees at a temperature, whose laws are known or sampled by the Metropolis algorithm."""

from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import mujoco


class Tree(NamedTuple):
    """A model at a temperature."""

    xml: str
    kT: float
    """In J."""
    friction: float | None = None
    """Rate in 1/s; None if the model has friction of its own."""
    disable: tuple[str, ...] = ()
    frequency: float | None = None
    """Largest angular frequency in rad/s, where it is not that of the rest position."""
    stiffness: float | None = None
    """Stiffness of all joints in N m/rad, instead of that in `xml`."""

    def model(self, timestep: float = 0.001) -> mujoco.MjModel:
        """Return the model."""
        load = mujoco.MjModel
        load = load.from_xml_path if self.xml.endswith(".xml") else load.from_xml_string
        model = load(self.xml)
        if self.stiffness is not None:
            model.jnt_stiffness[:] = self.stiffness
        model.opt.timestep = timestep
        return model


def _chain(links: str, *, head: str = "", tail: str = "", joints: str = "") -> str:
    """Return a chain of rods of 0.1 m and 1 kg; each letter is its joint: x, y, or b for a ball."""
    kinds = {"x": 'axis="1 0 0"', "y": 'axis="0 1 0"', "b": 'type="ball"'}
    rod = '<geom type="capsule" fromto="0 0 0 0 0 -0.1" size="0.01" mass="1"/>'
    text = ""
    for number, letter in reversed([*enumerate(links)]):
        joint = f'<joint name="joint {number}" {kinds[letter]} {joints}/>'
        text = f'<body pos="0 0 {-0.1 if number else 0}">{joint}{rod}{text}</body>'
    flags = '<option><flag contact="disable"/></option>'
    return f"<mujoco>{flags}{head}<worldbody>{text}</worldbody>{tail}</mujoco>"


CART = """
<mujoco>
  <worldbody>
    <body>
      <joint name="rail" type="slide" axis="1 0 0" stiffness="20" damping="2"/>
      <inertial pos="0 0 0" mass="0.5" diaginertia="1 1 1"/>
      <body>
        <joint name="pole" axis="0 1 0" damping="0.1"/>
        <inertial pos="0 0 -0.5" mass="1" diaginertia="0.03 0.03 0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

STONE = """
<mujoco>
  <option gravity="0 0 -2"/>
  <default><tendon/></default>
  <worldbody>
    <site name="a" pos="0.5 0 0"/>
    <site name="b" pos="-0.2 0.4 0"/>
    <site name="c" pos="-0.2 -0.3 0.5"/>
    <body>
      <freejoint name="stone"/>
      <inertial pos="0.02 0.01 0" mass="1" diaginertia="0.01 0.02 0.025"/>
      <site name="A" pos="0.2 0 0"/>
      <site name="B" pos="0 0.2 0.05"/>
      <site name="C" pos="-0.1 0 -0.2"/>
    </body>
  </worldbody>
  <tendon>
    <spatial stiffness="8" springlength="0"><site site="a"/><site site="A"/></spatial>
    <spatial stiffness="12" springlength="0"><site site="b"/><site site="B"/></spatial>
    <spatial stiffness="10" springlength="0"><site site="c"/><site site="C"/></spatial>
  </tendon>
</mujoco>
"""
"""A free body with three unequal moments on three springs."""


def _magnetic_tree(name: str, place: str) -> str:
    return f"""
    <body pos="{place}">
      <joint name="{name} 1" axis="1 0 0" stiffness="2e-6"/>
      <inertial pos="0 0 -0.02" mass="1e-3" diaginertia="2e-7 2e-7 1e-7"/>
      <body pos="0 0 -0.04">
        <joint name="{name} 2" type="ball"/>
        <inertial pos="0 0 -0.01" mass="1e-3" diaginertia="1e-7 1.5e-7 2e-7"/>
        <site pos="0 0 -0.02" zaxis="0 1 0" user="0.3"/>
      </body>
    </body>"""


MAGNETS = f"""
<mujoco>
  <option gravity="0 0 -1"/>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>{_magnetic_tree("left", "0 -0.09 0")}{_magnetic_tree("right", "0 0.09 0")}</worldbody>
</mujoco>
"""
"""Two arms, each of a hinge and a ball, with dipoles at their ends 18 cm from each other."""

WINGS = """
<mujoco>
  <option gravity="0 0 -3"/>
  <worldbody>
    <body>
      <joint name="shoulder" axis="0 1 0" stiffness="0.5"/>
      <inertial pos="0 0 -0.2" mass="1" diaginertia="0.02 0.02 0.01"/>
      <body pos="0 0 -0.4">
        <joint name="elbow" axis="0 1 0" stiffness="0.5"/>
        <inertial pos="0 0 -0.2" mass="1" diaginertia="0.02 0.02 0.01"/>
        <body pos="0 0 -0.4">
          <joint name="wrist" axis="1 0 0" stiffness="0.5"/>
          <inertial pos="0 0 -0.1" mass="0.5" diaginertia="0.01 0.005 0.01"/>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="belt" stiffness="3" damping="0.6">
      <joint joint="shoulder" coef="1"/><joint joint="elbow" coef="-0.7"/>
    </fixed>
    <fixed name="cord" stiffness="1" damping="0.3">
      <joint joint="elbow" coef="1"/><joint joint="wrist" coef="1"/>
    </fixed>
    <fixed name="brake" damping="0.3"><joint joint="elbow" coef="1"/></fixed>
  </tendon>
</mujoco>
"""
"""Three hinges coupled by springs of tendons, whose dampers are the only friction."""

LIMITS = """
<mujoco>
  <worldbody>
    <body>
      <joint name="hip" axis="0 1 0" limited="true" range="-20 30" solreflimit="0.2 0.5"
             solimplimit="0.5 0.5 0.1" damping="0.3"/>
      <inertial pos="0 0 -0.25" mass="1" diaginertia="0.02 0.02 0.01"/>
      <body pos="0 0 -0.5">
        <joint name="knee" axis="0 1 0" limited="true" range="-5 60" solreflimit="0.2 0.5"
               solimplimit="0.5 0.5 0.1" damping="0.2"/>
        <inertial pos="0 0 -0.25" mass="1" diaginertia="0.02 0.02 0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
"""Two links between soft limits of their joints, whose impedance is constant."""


KINOVA = Path("third_party", "kinova", "jaco_arm.xml")
ARM = Path(getattr(find_spec("dm_control"), "origin", "")).parent / KINOVA
"""The Kinova Jaco arm of dm_control: six joints with armature."""

TREES = {
    "pendulum": Tree(_chain("y", joints='damping="0.15"'), kT=0.3),
    "double pendulum": Tree(_chain("yy", joints='damping="0.08"'), kT=0.2),
    "double pendulum, weak friction": Tree(_chain("yy"), kT=0.2, friction=0.3),
    "six links, planar": Tree(_chain("yyyyyy"), kT=0.5, friction=10.0),
    "six links, weak friction": Tree(_chain("yyyyyy"), kT=0.5, friction=0.3),
    "six links in 3-D": Tree(_chain("xyxyxy", joints='damping="0.05"'), kT=0.15),
    "four ball joints": Tree(_chain("bbbb", joints='armature="0.001"'), kT=0.15, friction=10.0),
    "chain in a fluid": Tree(_chain("yxy", head='<option viscosity="30"/>'), kT=0.15),
    "cart-pole": Tree(CART, kT=1.5),
    "free body": Tree(STONE, kT=0.5, friction=5.0),
    "two magnetic trees": Tree(MAGNETS, kT=2e-6, friction=20.0),
    "tendons": Tree(WINGS, kT=1.0),
    "limits": Tree(LIMITS, kT=0.5, frequency=29.0),
    "arm of dm_control": Tree(
        str(ARM), 6.0, 3.0, ("contact", "frictionloss", "limit"), stiffness=30.0
    ),
}
"""Temperatures at which the motion is far from that of small oscillations."""
