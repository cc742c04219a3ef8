"""`mm.Langevin`, samples of the Metropolis algorithm, and the temperatures of runs."""

import math

import mujoco
import numpy as np
import xarray as xr

import magmotor as mm

ARM = """
<mujoco>
  <option timestep="0.002"><flag contact="{contact}"/></option>
  <default><geom condim="1" mass="1"/></default>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" type="ball" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.1 0 -0.5" size="0.05" contype="0" conaffinity="0"/>
      <body name="lower" pos="0.1 0 -0.5">
        <joint name="elbow" axis="0 1 0" {elbow}/>
        <geom name="forearm" type="capsule" fromto="0 0 0 0 0 -0.5" size="0.05"/>
      </body>
    </body>
    <body name="slider" pos="1 0 -0.9">
      <joint name="slide" type="slide" axis="1 0 0" damping="0.1"/>
      <geom name="block" type="sphere" size="0.1"/>
    </body>
    {body}
  </worldbody>
  <actuator>{actuator}</actuator>
</mujoco>
"""

CART = """
<mujoco>
  <option {option}>{flags}</option>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" {floor}/>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0" {rail}/>
      <geom name="box" type="box" size="0.1 0.1 0.1" {box}/>
      <body name="pole" pos="0 0 0.1">
        <joint name="pin" axis="0 1 0" {pin}/>
        <geom name="rod" type="capsule" fromto="0 0 0 0 0 1" size="0.02"/>
        <site name="top" pos="0 0 1"/>
        <body name="bob" pos="0 0 1.5">
          <joint name="ball" type="ball" {ball}/>
          <geom size="0.1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <contact>{pair}</contact>
  <tendon>
    <fixed name="cord" {cord}><joint joint="rail" coef="1"/><joint joint="pin" coef="2"/></fixed>
  </tendon>
  <equality>{equality}</equality>
  <actuator>{actuator}</actuator>
</mujoco>
"""
PARTS = (
    "option", "flags", "floor", "rail", "box", "pin", "ball", "pair", "cord",
    "equality", "actuator",
)  # fmt: skip
TOUCHING = 'contype="1" conaffinity="1"'
SERVO = '<general name="servo" joint="pin" biastype="affine" biasprm="0 0 -2" {}/>'
ON_CORD = '<general name="servo" tendon="cord" biastype="affine" biasprm="0 0 -2"/>'
ON_SITE = '<general name="servo" site="top" biastype="affine" biasprm="1 0 0"/>'
STRANGE = '<general name="servo" joint="pin" {}/>'
PAIR = '<pair name="p" geom1="box" geom2="floor" {}/>'

LONE = """
<mujoco>
  <option cone="elliptic" impratio="1e-14" gravity="0 0 -1"/>
  <size nuserdata="1"/>
  <custom><text name="magmotor" data="noise"/></custom>
  <default>
    <geom contype="0" conaffinity="0" size="0.1 0.1 0.1"/>
  </default>
  <worldbody>
    <site name="a"/>
    <site name="b" pos="1 0 0"/>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="post" pos="3 0 0"><geom name="post"/></body>
    <body name="lamp" mocap="true"/>
    <body name="disk" pos="0 0 0.1" user="1 0 0 0 -0.1 0">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="turn" type="hinge" axis="0 -1 0"/>
      <geom name="rim"/>
    </body>
    <body name="top" pos="5 0 0.1" user="0 0 0 1 0 0  0 0 0 0 1 0  0 0 0 0 0 1">
      <joint name="spin" type="ball" damping="0.1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1.5"/>
      <geom name="head"/>
    </body>
  </worldbody>
  <contact>
    <pair name="slip" geom1="floor" geom2="rim" condim="3" margin="1e-3"
          friction="1e6 1e6 0 0 0" solref="-400 -40" solimp="1e-4 1e-4 0.001 0.5 2"
          solreffriction="0 -1e12"/>
  </contact>
  <tendon>
    <fixed name="rope"><joint joint="x" coef="1"/><joint joint="turn" coef="0.5"/></fixed>
  </tendon>
</mujoco>
"""
"""Bodies that hang on the world one by one, whose noise is the model's own."""
ROWS = "0 0 0 1 0 0  0 0 0 0 1 0  0 0 0 0 0 1"

DOUBLE = """
<mujoco>
  <worldbody>
    <body>
      <joint name="upper" axis="0 1 0"/>
      <inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/>
      <body pos="0 0 -1">
        <joint axis="0 1 0"/>
        <inertial pos="0 0 -0.5" mass="3" diaginertia="0.2 0.2 0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

STOPPED = """
<mujoco>
  <option timestep="0.02"/>
  <worldbody>
    <body>
      <joint type="slide" axis="1 0 0" range="-0.1 0" damping="0.5" solreflimit="{}"
             solimplimit="0.95 0.95 0.001"/>
      <geom size="0.1" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""

SPHERES = "".join(f'<geom size="0.1" pos="{i} 0 0" condim="1" mass="0.025"/>' for i in range(40))
MANY_CONTACTS = f"""
<mujoco>
  <option timestep="0.01"/>
  <worldbody>
    <geom type="plane" size="1 1 1" condim="1"/>
    <body pos="0 0 0.1"><joint type="slide" damping="1"/>{SPHERES}</body>
  </worldbody>
</mujoco>
"""

NO_MEMORY = """
<mujoco>
  <option timestep="1e-3"/>
  <size memory="20K"/>
  <worldbody>
    <geom type="plane" size="1 1 1" condim="1" contype="0"/>
    {}
  </worldbody>
</mujoco>
""".format(
    "".join(
        f'<body pos="{i} 0 0.09"><freejoint/><geom type="box" size="0.1 0.1 0.1" condim="1"'
        ' conaffinity="0"/></body>'
        for i in range(10)
    )
)

TWO_NEEDLES = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <body>
      <joint type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <site name="north" user="1"/>
    </body>
    <body>
      <joint type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <site name="south" user="1"/>
    </body>
  </worldbody>
</mujoco>
"""

BOXES = """
<mujoco><option timestep="1e-3"/><worldbody>
  <geom name="floor" type="{}" size="1 1 0.1" condim="1"/>
  <body name="box" pos="0 0 0.25">
    <freejoint name="free"/><geom name="cube" type="box" size="0.1 0.1 0.1" condim="1"/>
  </body>
</worldbody></mujoco>
"""

PID = """
<mujoco>
  <extension><plugin plugin="mujoco.pid"/></extension>
  <worldbody>
    <body><joint name="hinge" axis="0 1 0" damping="1"/><geom size="0.1" pos="0 0 -1"/></body>
  </worldbody>
  <actuator><plugin plugin="mujoco.pid" joint="hinge"/></actuator>
</mujoco>
"""


def load(xml: str) -> mujoco.MjModel:
    """Return a model."""
    return mujoco.MjModel.from_xml_string(xml)


def arm(elbow='damping="0.1"', contact="disable", body="", actuator="") -> mujoco.MjModel:
    """Return an arm and a block on a slide, with changed parts."""
    return load(ARM.format(elbow=elbow, contact=contact, body=body, actuator=actuator))


def cart(disable="", **parts) -> mujoco.MjModel:
    """Return a pole on a cart, in a fluid, with a disabled flag and with changed parts."""
    flags = f'<flag {disable}="disable"/>' if disable else ""
    fluid = {"flags": flags, "option": 'timestep="1e-4" viscosity="1"'}
    return load(CART.format(**dict.fromkeys(PARTS, "") | fluid | parts))


def lone(old="", new="") -> mujoco.MjModel:
    """Return a disk and a top, with a changed text."""
    assert not old or LONE.count(old) == 1
    return load(LONE.replace(old, new))


def based(joint: str) -> mujoco.MjModel:
    """Return a damped arm on a base with this joint."""
    return load(
        f'<mujoco><option timestep="0.0001"/><worldbody><body>{joint}<geom size="0.1"/><body>'
        '<joint axis="1 1 0" damping="1"/><geom size="0.1" pos="0.3 0 0"/></body></body>'
        "</worldbody></mujoco>"
    )


def slides(*joints: str, timestep=0.002, gravity=0.0) -> mujoco.MjModel:
    """Return unit masses on slides with these attributes."""
    bodies = "".join(
        f'<body pos="{k} 0 0"><joint name="j{k}" type="slide" {joint}/><geom size="0.1" mass="1"/>'
        "</body>"
        for k, joint in enumerate(joints)
    )
    return load(
        f'<mujoco><option timestep="{timestep}" gravity="0 0 {gravity}"><flag contact="disable"/>'
        f"</option><worldbody>{bodies}</worldbody></mujoco>"
    )


def sampled(langevin: mm.Langevin, steps: int, burn_in=0, **options) -> xr.Dataset:
    """Return a sample of a number of steps after others."""
    h = langevin.timestep
    return langevin.sample(steps * h, burn_in=burn_in * h, **options)


def records(**variables) -> xr.Dataset:
    """Return 20 records of a double pendulum with changed variables."""
    known = {
        "qpos": (("time", "nq"), np.zeros((20, 2))),
        "qvel": (("time", "nv"), np.zeros((20, 2))),
    }
    return xr.Dataset(known | variables)


TABLE = r"""
# Temperatures
>>> mm.Langevin(arm(), kT=-1.0)
ArgumentError: kT = -1.0: must be at least 0 J
>>> mm.Langevin(arm(), kT={})
ArgumentError: kT = {}: must name at least one joint, tendon, actuator or body
>>> mm.Langevin(arm(), kT={"knee": 1.0})
ArgumentError: kT = 'knee': must be the name of a joint, tendon, actuator or body
>>> mm.Langevin(arm(), kT={"\udcff": 1.0})
ArgumentError: kT = '\udcff': must be the name of a joint, tendon, actuator or body
>>> mm.Langevin(arm(), kT={"work": 1.0})
ArgumentError: kT = 'work': must be another name: `step` returns the work of all forces by it
>>> named = {"upper": 1.0, "lower": 1.0, "slider": 1.0, "elbow": 2.0, "shoulder": 3.0}
>>> mm.Langevin(arm(), kT=named)
ArgumentError: kT = 'upper': must be the name of something that damps
>>> mm.Langevin(arm(), kT={"upper": 1.0})
ArgumentError: kT = ['upper']: must have the temperature of joint 'elbow', by its name or that of
    its body
>>> mm.Langevin(arm(), kT={"upper": 1.0, "lower": -2.0})
ArgumentError: kT['lower'] = -2.0: must be at least 0 J
>>> mm.Langevin(arm(), kT={"upper": 1.0, "lower": 1.0, "slider": 2.0}, friction=1.0)
ArgumentError: kT = {'upper': 1.0, 'lower': 1.0, 'slider': 2.0}: must be one temperature, since
    friction as given belongs to no single joint

# Splittings, flags and paths
>>> mm.Langevin("model.xml")
ArgumentError: model = 'model.xml': must be an instance of mujoco.MjModel, such as
    mujoco.MjModel.from_xml_path(...)
>>> mm.Langevin(None)
ArgumentError: model = None: must be an instance of mujoco.MjModel
>>> mm.Langevin(3)
ArgumentError: model = 3: must be an instance of mujoco.MjModel
>>> mm.Langevin(arm(), kT=1, splitting="baob")
ArgumentError: splitting = 'baob': must be one of baoab, middle, verlet, obabo, o-rk4-o, o-step-o
    (did you mean 'baoab'?)
>>> mm.Langevin(arm(), kT=1, disable=["contacts"])
ArgumentError: disable = 'contacts': must be one of constraint, equality, frictionloss, limit,
    contact, spring, ... (did you mean 'contact'?)
>>> mm.Langevin(arm(), kT=1, path=mm.noise.BrownianPath(1, 0.1))
ArgumentError: path.timestep = 0.1: must be the timestep of the model, 0.002

# Friction as given
>>> mm.Langevin(arm(), kT=1, friction=-1.0)
ArgumentError: friction = -1.0: must be at least 0 1/s
>>> mm.Langevin(arm(), kT=1, friction=0.0)
ArgumentError: friction = 0.0: must damp something, or else kT is never reached: add damping to
    joints or viscosity to the model's options, or give a rate such as friction=1.0
>>> mm.Langevin(arm(), kT=1, friction=[1, 1, 1, -1, 1])
ArgumentError: friction of joint 'elbow' = -1.0: must be zero or greater
>>> mm.Langevin(arm(), kT=1, friction=[1, 2])
InputError: friction has shape (2,): must have shape (..., 5)
>>> mm.Langevin(arm(), kT=1, friction=np.eye(5) + np.eye(5, k=1))
ArgumentError: friction = [[1.0, 1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0,
    1.0, 0.0], [0.0, 0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 0.0, 1.0]]: must be symmetric
>>> mm.Langevin(arm(), kT=1, friction=np.eye(5) + 2 * (np.eye(5, k=1) + np.eye(5, k=-1)))
ArgumentError: friction = 'matrix with the eigenvalue -2.4641': must be positive semidefinite; its
    smallest eigenvalue belongs to a motion of joint 'shoulder'

# A model that nothing damps
>>> model = arm()
>>> model.dof_damping[:] = 0
>>> mm.Langevin(model, kT=1)
ArgumentError: friction = 0.0: must damp something, or else kT is never reached: add damping to
    joints or viscosity to the model's options, or give a rate such as friction=1.0
>>> mm.Langevin(model, kT=1, friction=1.0)

# Numbers of a model
>>> model = cart()
>>> model.dof_armature[3] = 1.0
>>> mm.Langevin(model, kT=1)
ArgumentError: joint 'ball': armature = [0.0, 1.0, 0.0]: must be the same about all three axes
    (splitting='o-step-o' with friction=1.0 takes every model, but can be far too cold where dry
    friction acts)
>>> model.jnt_stiffness[0] = math.nan
>>> mm.Langevin(model, kT=1)
InputError: jnt_stiffness of the model contains nan: every value must be finite and at most 1e+30
    in magnitude
>>> model.dof_damping[0] = math.nan
>>> mm.Langevin(model)
InputError: dof_damping of the model contains nan: every value must be finite and at most 1e+30 in
    magnitude
>>> model.body_mass[1] = math.inf
>>> mm.Langevin(model)
InputError: body_mass of the model contains inf: every value must be finite and at most 1e+30 in
    magnitude
>>> model.opt.timestep = 0.0
>>> mm.Langevin(model, kT=1)
ArgumentError: timestep = 0.0: must be greater than 0
>>> model.opt.timestep = -1.0
>>> mm.Langevin(model)
ArgumentError: timestep = -1.0: must be greater than 0
>>> model = lone()
>>> model.body_user[1, 0] = math.nan
>>> mm.Langevin(model)
InputError: body 'post': user contains nan: every value must be finite and at most 1e+30 in
    magnitude
>>> mm.Langevin(model, kT=1, friction=1.0)
InputError: body 'post': user contains nan: every value must be finite and at most 1e+30 in
    magnitude
>>> model = cart(option='viscosity="1"', flags='<flag sleep="enable"/>')
>>> mm.Langevin(model, kT=1)
ArgumentError: flag sleep = 'enable': must be 'disable' (splitting='o-step-o' with friction=1.0
    takes every model, but can be far too cold where dry friction acts)
>>> model = cart()
>>> model.opt.viscosity = math.inf
>>> mm.Langevin(model, kT=1)
ArgumentError: option viscosity = inf: must be zero or greater, and finite (splitting='o-step-o'
    with friction=1.0 takes every model, but can be far too cold where dry friction acts)
>>> model = cart()
>>> model.jnt_solref[:] = 1e300
>>> mm.Langevin(model, kT=1)
InputError: jnt_solref of the model contains 1e+300: every value must be finite and at most 1e+30
    in magnitude
>>> model = cart()
>>> model.body_gravcomp[:] = math.inf
>>> mm.Langevin(model, kT=1, splitting="o-step-o", friction=1.0)
InputError: body_gravcomp of the model contains inf: every value must be finite and at most 1e+30
    in magnitude

# Dry friction
>>> mm.Langevin(cart(rail='frictionloss="1"'), kT=1)
ArgumentError: joint 'rail': frictionloss = 1.0: must be zero (disable=['frictionloss'] lets
    Langevin ignore this; splitting='o-step-o' with friction=1.0 takes every model, but can be far
    too cold where dry friction acts)
>>> mm.Langevin(cart("frictionloss", rail='frictionloss="1"'), kT=1)
>>> mm.Langevin(cart(cord='frictionloss="1"'), kT=1)
ArgumentError: tendon 'cord': frictionloss = 1.0: must be zero (disable=['frictionloss'] lets
    Langevin ignore this; splitting='o-step-o' with friction=1.0 takes every model, but can be far
    too cold where dry friction acts)
>>> mm.Langevin(cart("frictionloss", cord='frictionloss="1"'), kT=1)

# Damping that is not linear
>>> mm.Langevin(cart(rail='damping="1 0.5"'), kT=1)
ArgumentError: joint 'rail': dampingpoly = [0.5, 0.0]: damping that depends on velocity has no law
    of fluctuation and dissipation: make it zero or disable the flag damper (disable=['damper']
    lets Langevin ignore this; splitting='o-step-o' with friction=1.0 takes every model, but can
    be far too cold where dry friction acts)
>>> mm.Langevin(cart("damper", rail='damping="1 0.5"'), kT=1)

# Armature
>>> mm.Langevin(cart(cord='armature="1"'), kT=1)
ArgumentError: tendon 'cord': armature = 1.0: must be zero (splitting='o-step-o' with friction=1.0
    takes every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(cart(actuator='<motor name="servo" tendon="cord" armature="1"/>'), kT=1)
ArgumentError: actuator 'servo': armature = 1.0: must be zero on a tendon: Langevin does not
    support it (splitting='o-step-o' with friction=1.0 takes every model, but can be far too cold
    where dry friction acts)

# Contacts
>>> mm.Langevin(cart(box=TOUCHING, floor=TOUCHING), kT=1)
ArgumentError: geom 'floor' and geom 'box': condim = 3: must be 1, for contacts without friction:
    dry friction has no temperature (disable=['contact'] lets Langevin ignore this;
    splitting='o-step-o' with friction=1.0 takes every model, but can be far too cold where dry
    friction acts)
>>> mm.Langevin(cart("contact", box=TOUCHING, floor=TOUCHING), kT=1)
>>> mm.Langevin(cart(box=f'{TOUCHING} condim="1"', floor=TOUCHING), kT=1)
ArgumentError: geom 'floor' and geom 'box': condim = 3: must be 1, for contacts without friction:
    dry friction has no temperature (disable=['contact'] lets Langevin ignore this;
    splitting='o-step-o' with friction=1.0 takes every model, but can be far too cold where dry
    friction acts)
>>> mm.Langevin(cart("contact", box=f'{TOUCHING} condim="1"', floor=TOUCHING), kT=1)
>>> mm.Langevin(cart(pair=PAIR.format("")), kT=1)
ArgumentError: pair 'p': condim = 3: must be 1, for contacts without friction: dry friction has no
    temperature (disable=['contact'] lets Langevin ignore this; splitting='o-step-o' with
    friction=1.0 takes every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(cart("contact", pair=PAIR.format("")), kT=1)
>>> mm.Langevin(cart(pair=PAIR.format('friction="1e6 1e6"')), kT=1)
ArgumentError: pair 'p': friction = 1000000.0: viscous contacts are for bodies that hang on the
    world one by one, with the noise of the model: use mm.Langevin(model) without kT
    (disable=['contact'] lets Langevin ignore this; splitting='o-step-o' with friction=1.0 takes
    every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(cart("contact", pair=PAIR.format('friction="1e6 1e6"')), kT=1)
>>> model = arm(contact="enable")
>>> model.geom_condim[:] = 3
>>> mm.Langevin(model, kT=1)
ArgumentError: geom 'forearm' and geom 'block': condim = 3: must be 1, for contacts without
    friction: dry friction has no temperature (disable=['contact'] lets Langevin ignore this;
    splitting='o-step-o' with friction=1.0 takes every model, but can be far too cold where dry
    friction acts)
>>> mm.Langevin(model, kT=1, disable=["contact"])
>>> mm.Langevin(model, kT=1, splitting="o-step-o")
>>> mm.Langevin(load(BOXES.format("box")), kT=1, friction=1.0)
ArgumentError: geom 'floor' and geom 'cube': types = 'box and box': their contact points jump, so
    that the force has no potential: use spheres or capsules, or boxes and cylinders on planes
    (disable=['contact'] lets Langevin ignore this; splitting='o-step-o' with friction=1.0 takes
    every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(load(BOXES.format("plane")), kT=1, friction=1.0)

# Actuators without a potential
>>> mm.Langevin(load(PID), kT=1)
ArgumentError: number of plugins = 1: must be zero, except for magmotor.forces and those of geoms
    and sensors: Langevin does not support them (disable=['actuation'] lets Langevin ignore this;
    splitting='o-step-o' with friction=1.0 takes every model, but can be far too cold where dry
    friction acts)
>>> mm.Langevin(load(PID), kT=1, disable=["actuation"])
>>> adhesion = '<adhesion name="servo" body="cart" ctrlrange="0 1"/>'
>>> mm.Langevin(cart(actuator=adhesion), kT=1)
ArgumentError: actuator 'servo': transmission = 'body': must not be a body, since adhesion has no
    potential (disable=['actuation'] lets Langevin ignore this; splitting='o-step-o' with
    friction=1.0 takes every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(cart("actuation", actuator=adhesion), kT=1)
>>> on_a_ball = '<position name="servo" joint="ball" kp="1"/>'
>>> mm.Langevin(cart(actuator=on_a_ball), kT=1)
ArgumentError: actuator 'servo': transmission = 'joint': must act on a hinge, a slide, a tendon or
    a slider-crank, since its force depends on the position and has no potential otherwise
    (disable=['actuation'] lets Langevin ignore this; splitting='o-step-o' with friction=1.0 takes
    every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(cart("actuation", actuator=on_a_ball), kT=1)
>>> mm.Langevin(cart(actuator=ON_SITE), kT=1)
ArgumentError: actuator 'servo': transmission = 'site': must act on a hinge, a slide, a tendon or
    a slider-crank, since its force depends on the position and has no potential otherwise
    (disable=['actuation'] lets Langevin ignore this; splitting='o-step-o' with friction=1.0 takes
    every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(cart("actuation", actuator=ON_SITE), kT=1)
>>> on_the_cord = '<position name="servo" tendon="cord" kp="1"/>'
>>> limited = {"pin": 'actuatorfrcrange="-1 1"', "actuator": on_the_cord}
>>> mm.Langevin(cart(**limited), kT=1)
ArgumentError: joint 'pin': actfrcrange = [-1.0, 1.0]: must be without limits, since actuator
    'servo' acts on several joints, and its force has no potential where one of them limits it
    (disable=['actuation'] lets Langevin ignore this; splitting='o-step-o' with friction=1.0 takes
    every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(cart("actuation", **limited), kT=1)

# What a model at a temperature may have
>>> mm.Langevin(cart(), kT=1)
>>> mm.Langevin(cart(rail='range="-1 1" limited="true" damping="1" stiffness="3"'), kT=1)
>>> one = f'{TOUCHING} condim="1"'
>>> mm.Langevin(cart(box=one, floor=one), kT=1)
>>> mm.Langevin(cart(box=f'{one} priority="1"', floor=f'{TOUCHING} condim="3"'), kT=1)
>>> mm.Langevin(cart(pair=PAIR.format('condim="1"'), box=TOUCHING, floor=TOUCHING), kT=1)
>>> joined = '<joint joint1="rail" joint2="pin"/><connect body1="bob" anchor="0 0 0"/>'
>>> mm.Langevin(cart(equality=joined), kT=1)
>>> motor = '<motor site="top" gear="1 0 0 0 0 0"/>'
>>> mm.Langevin(cart(actuator='<position joint="pin" kp="3" kv="1"/>' + motor), kT=1)
>>> mm.Langevin(cart(actuator='<position joint="pin" kp="3" forcerange="-1 1"/>'), kT=1)
>>> mm.Langevin(cart(ball='armature="0.1" damping="1"'), kT=1)

# Friction without a law
>>> mm.JointNoise(cart(rail='damping="1 0.5"'), kT=1)
ArgumentError: joint 'rail': dampingpoly = [0.5, 0.0]: damping that depends on velocity has no law
    of fluctuation and dissipation: make it zero or disable the flag damper
>>> mm.JointNoise(cart("damper", rail='damping="1 0.5"'), kT=1)
>>> mm.JointNoise(cart(cord='damping="1 0.5"'), kT=1)
ArgumentError: tendon 'cord': dampingpoly = [0.5, 0.0]: damping that depends on velocity has no
    law of fluctuation and dissipation: make it zero or disable the flag damper
>>> mm.JointNoise(cart("damper", cord='damping="1 0.5"'), kT=1)
>>> quadratic = '<motor name="servo" joint="pin" damping="0 1"/>'
>>> mm.JointNoise(cart(actuator=quadratic), kT=1)
ArgumentError: actuator 'servo': dampingpoly = [1.0, 0.0]: damping that depends on velocity has no
    law of fluctuation and dissipation: make it zero or disable the flag damper
>>> mm.JointNoise(cart("damper", actuator=quadratic), kT=1)
>>> mm.JointNoise(cart(option='density="1"'), kT=1)
ArgumentError: option density = 1.0: must be set to zero, since drag by the square of the velocity
    has no law of fluctuation and dissipation
>>> mm.JointNoise(cart(option='viscosity="1" wind="1 0 0"'), kT=1)
ArgumentError: option wind = [1.0, 0.0, 0.0]: must be zero in a viscous fluid, since wind drives
    the model
>>> model = cart()
>>> model.dof_damping[0] = model.tendon_damping[0] = -0.1
>>> mm.JointNoise(model, kT=1)
ArgumentError: joint 'rail': damping = -0.1: negative damping has no law of fluctuation and
    dissipation: make it zero or disable the flag damper
>>> model.dof_damping[0] = 0
>>> mm.JointNoise(model, kT=1)
ArgumentError: tendon 'cord': damping = -0.1: negative damping has no law of fluctuation and
    dissipation: make it zero or disable the flag damper

# Friction of actuators without a law
>>> damper = '<damper name="servo" joint="pin" kv="2" ctrlrange="0 1"/>'
>>> mm.JointNoise(cart(actuator=damper), kT=1)
ArgumentError: actuator 'servo': gainprm[2] = -2.0: damping that depends on the control has no law
    of fluctuation and dissipation: change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=damper), kT=1)
>>> muscle = '<muscle name="servo" joint="pin" lengthrange="0 1"/>'
>>> mm.JointNoise(cart(actuator=muscle), kT=1)
ArgumentError: actuator 'servo': gaintype = 'muscle': must be affine, or simpler, to be linear:
    change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=muscle), kT=1)
>>> mm.JointNoise(cart(actuator=STRANGE.format('gaintype="user"')), kT=1)
ArgumentError: actuator 'servo': gaintype = 'user': must be affine, or simpler, to be linear:
    change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=STRANGE.format('gaintype="user"')), kT=1)
>>> mm.JointNoise(cart(actuator=STRANGE.format('biastype="user"')), kT=1)
ArgumentError: actuator 'servo': biastype = 'user': must be affine, or simpler, to be linear:
    change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=STRANGE.format('biastype="user"')), kT=1)
>>> mm.JointNoise(cart(actuator=STRANGE.format('dyntype="integrator"')), kT=1)
ArgumentError: actuator 'servo': dyntype = 'integrator': must be none, since its state changes by
    itself: change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=STRANGE.format('dyntype="integrator"')), kT=1)
>>> late = '<motor name="servo" joint="pin" delay="0.01" nsample="20"/>'
>>> mm.JointNoise(cart(actuator=late), kT=1)
ArgumentError: actuator 'servo': delay = 0.01: a delayed force has no law of fluctuation and
    dissipation: change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=late), kT=1)
>>> negative = STRANGE.format('biastype="affine" biasprm="0 0 3"')
>>> mm.JointNoise(cart(actuator=negative), kT=1)
ArgumentError: actuator 'servo': biasprm[2] = 3.0: must not be positive, since negative damping
    has no law of fluctuation and dissipation: change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=negative), kT=1)

# Friction of actuators with limits
>>> limited = SERVO.format('forcerange="-1 1"')
>>> mm.JointNoise(cart(actuator=limited), kT=1)
ArgumentError: actuator 'servo': forcerange = [-1.0, 1.0]: must be without limits, since actuator
    'servo' damps (its biasprm[2] is not zero), and a damper that is clamped has no law of
    fluctuation and dissipation: change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=limited), kT=1)
>>> limits = 'actuatorfrcrange="-1 1"'
>>> mm.JointNoise(cart(actuator=SERVO.format(""), pin=limits), kT=1)
ArgumentError: joint 'pin': actfrcrange = [-1.0, 1.0]: must be without limits, since actuator
    'servo' damps (its biasprm[2] is not zero), and a damper that is clamped has no law of
    fluctuation and dissipation: change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=SERVO.format(""), pin=limits), kT=1)
>>> mm.JointNoise(cart(actuator=ON_CORD, rail=limits), kT=1)
ArgumentError: joint 'rail': actfrcrange = [-1.0, 1.0]: must be without limits, since actuator
    'servo' damps (its biasprm[2] is not zero), and a damper that is clamped has no law of
    fluctuation and dissipation: change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=ON_CORD, rail=limits), kT=1)
>>> mm.JointNoise(cart(actuator=ON_CORD, cord=limits), kT=1)
ArgumentError: tendon 'cord': actfrcrange = [-1.0, 1.0]: must be without limits, since actuator
    'servo' damps (its biasprm[2] is not zero), and a damper that is clamped has no law of
    fluctuation and dissipation: change it or disable the flag actuation
>>> mm.JointNoise(cart("actuation", actuator=ON_CORD, cord=limits), kT=1)

# Every obstacle and the flags that help
>>> servo = '<position name="servo" joint="elbow" kv="2" forcerange="-1 1"/>'
>>> model = arm('damping="0.1" frictionloss="0.1"', contact="enable", actuator=servo)
>>> model.geom_condim[:] = 3
>>> mm.Langevin(model, kT=1, disable=["limit"])
InputError: actuator 'servo': forcerange = [-1.0, 1.0]: must be without limits, since actuator
    'servo' damps (its biasprm[2] is not zero), and a damper that is clamped has no law of
    fluctuation and dissipation: change it or disable the flag actuation; joint 'elbow':
    frictionloss = 0.1: must be zero; geom 'forearm' and geom 'block': condim = 3: must be 1, for
    contacts without friction: dry friction has no temperature (disable=['limit', 'actuation',
    'frictionloss', 'contact'] lets Langevin ignore these; splitting='o-step-o' with friction=1.0
    takes every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(model, kT=1, disable=["limit", "frictionloss", "contact"])
ArgumentError: actuator 'servo': forcerange = [-1.0, 1.0]: must be without limits, since actuator
    'servo' damps (its biasprm[2] is not zero), and a damper that is clamped has no law of
    fluctuation and dissipation: change it or disable the flag actuation (disable=['limit',
    'frictionloss', 'contact', 'actuation'] lets Langevin ignore this; splitting='o-step-o' with
    friction=1.0 takes every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(model, kT=1, disable=["limit", "actuation", "contact"])
ArgumentError: joint 'elbow': frictionloss = 0.1: must be zero (disable=['limit', 'actuation',
    'contact', 'frictionloss'] lets Langevin ignore this; splitting='o-step-o' with friction=1.0
    takes every model, but can be far too cold where dry friction acts)
>>> mm.Langevin(model, kT=1, disable=["limit", "actuation", "frictionloss"])
ArgumentError: geom 'forearm' and geom 'block': condim = 3: must be 1, for contacts without
    friction: dry friction has no temperature (disable=['limit', 'actuation', 'frictionloss',
    'contact'] lets Langevin ignore this; splitting='o-step-o' with friction=1.0 takes every
    model, but can be far too cold where dry friction acts)
>>> flags = ["limit", "actuation", "frictionloss", "contact"]
>>> mm.Langevin(model, kT=1, disable=flags)
>>> model.opt.density = 1.0
>>> mm.Langevin(model, kT=1, disable=flags)
ArgumentError: option density = 1.0: must be set to zero, since drag by the square of the velocity
    has no law of fluctuation and dissipation (splitting='o-step-o' with friction=1.0 takes every
    model, but can be far too cold where dry friction acts)

# Joints without inertia
>>> point = '<inertial pos="0 0 0" mass="1" diaginertia="2e-15 2e-15 2e-15"/>'
>>> body = f'<body><joint name="empty" damping="1"/>{point}</body>'
>>> mm.Langevin(load(f"<mujoco><worldbody>{body}</worldbody></mujoco>"), kT=1)
ArgumentError: joint 'empty': inertia at qpos0 = 0.0: must be positive: give its body a mass, or
    the joint an armature (splitting='o-step-o' with friction=1.0 takes every model, but can be
    far too cold where dry friction acts)

# What never reaches equilibrium
>>> model = arm(body='<body pos="3 0 0"><freejoint name="free"/><geom size="0.1"/></body>')
>>> mm.Langevin(model, kT=1, disable=["gravity"])
UserWarning: joint 'free': nothing damps its tree, which never reaches kT unless forces couple it
    to what is damped; give a rate such as friction=1.0, or viscosity
>>> mm.Langevin(model, kT=1, friction=1.0)
UserWarning: joint 'free': nothing holds its tree, which falls forever and has no equilibrium:
    disable gravity, too, or keep the contact with a floor, without friction
>>> mm.Langevin(model, kT=1, disable=["gravity"], friction=1.0)
>>> mm.Langevin(based('<joint name="x" type="slide" axis="1 0 0"/>'), kT=1, disable=["contact"])
UserWarning: joint 'x': nothing damps the motion of its tree as a whole, which never reaches kT
    unless forces couple it to what is damped; give a rate such as friction=1.0, or viscosity
>>> mm.Langevin(based('<joint name="yaw" axis="0 0 1"/>'), kT=1, disable=["contact"])
UserWarning: joint 'yaw': nothing damps the motion of its tree as a whole, which never reaches kT
    unless forces couple it to what is damped; give a rate such as friction=1.0, or viscosity
>>> up = '<joint name="z" type="slide" axis="0 0 1" damping="1" {}/>'
>>> mm.Langevin(based(up.format("")), kT=1, disable=["contact"])
UserWarning: joint 'z': nothing holds its tree, which falls forever and has no equilibrium:
    disable gravity, too, or keep the contact with a floor, without friction
>>> held = up.format('limited="true" range="0 1"')
>>> mm.Langevin(based(held), kT=1, disable=["contact"])
>>> mm.Langevin(based(up.format('stiffness="1"')), kT=1, disable=["contact"])
>>> mm.Langevin(based('<joint name="swing" axis="0 1 0"/>'), kT=1, disable=["contact"])

# Constraints that are softened
>>> mm.Langevin(load(STOPPED.format("0.02 1")), kT=0.3)
UserWarning: soft constraints are softened to suit the timestep 0.02: joint limits (1, up to 8.9
    times slower); take a shorter timestep, or increase their solref, to keep them as they are;
    effective_model has the potential used
>>> mm.Langevin(load(STOPPED.format("-2500 -100")), kT=0.3)
UserWarning: soft constraints are softened to suit the timestep 0.02: joint limits (1, up to 8.9
    times slower); take a shorter timestep, or increase their solref, to keep them as they are;
    effective_model has the potential used
>>> mm.Langevin(load(MANY_CONTACTS), kT=1e-3)
UserWarning: soft constraints are softened to suit the timestep 0.01: contacts of geoms (41, up to
    28 times slower); take a shorter timestep, or increase their solref, to keep them as they are;
    effective_model has the potential used

# Steps
>>> model = arm()
>>> langevin = mm.Langevin(model, kT=1)
>>> langevin.step(None)
ArgumentError: data = None: must be an instance of mujoco.MjData
>>> langevin.step(3)
ArgumentError: data = 3: must be an instance of mujoco.MjData
>>> langevin.step(mujoco.MjData(arm()))
ArgumentError: data.model = <mujoco...MjModel object at 0x...>: must be the model
    of this Langevin
>>> langevin.step(mujoco.MjData(model), 1.5)
ArgumentError: nstep = 1.5: must be an integer
>>> langevin.step(mujoco.MjData(model), 2**53)
ArgumentError: nstep = 9007199254740992: must be less than 2^53 = 9007199254740992
>>> langevin.sample(2e8, replicas=100)
ArgumentError: duration = 200000000.0: 100 x 100000000000 records do not fit in memory
>>> mm.Langevin(model, kT=1, splitting="o-step-o").largest_timestep(mujoco.MjData(model))
ArgumentError: splitting = 'o-step-o': must not consist of steps of MuJoCo
>>> data = mujoco.MjData(model)
>>> data.time = math.inf
>>> langevin.step(data)
ArgumentError: data.time = inf: must be finite and between -2^53 and 2^53 timesteps
>>> mujoco.set_mjcb_passive(lambda model, data: None)
>>> langevin.step(mujoco.MjData(model))
ArgumentError: mjcb_passive = 'a function': must not be set (by magnetism(), either) while this
    Langevin runs
>>> mujoco.set_mjcb_passive(None)
>>> model.opt.timestep = 0.5
>>> langevin.step(mujoco.MjData(model))
ArgumentError: timestep = 0.5: must still be 0.002, since Langevin reads it only once
>>> needles = load(TWO_NEEDLES)
>>> mm.Langevin(needles).step(mujoco.MjData(needles))
FatalError: dipole sites 1 'south' and 0 'north' coincide: their force is undefined
>>> full = load(NO_MEMORY)
>>> mm.Langevin(full, kT=1e-3, friction=1.0).step(mujoco.MjData(full))
FatalError: at t = 0.001: there is no memory for all contacts: increase memory in <size
    memory="..."/>

# Rollouts
>>> model = slides("", "")
>>> langevin, data = mm.Langevin(model), mujoco.MjData(model)
>>> starts = np.zeros((2, 5))
>>> langevin.rollout([], starts, None, control_spec=0, nstep=1)
ArgumentError: data = []: must be a sequence of at least one MjData
>>> langevin.rollout([data], np.zeros((2, 4)), None, control_spec=0, nstep=1)
InputError: initial_state has shape (2, 4): must have shape (replicas, 5)
>>> langevin.rollout([data], starts, np.zeros((3, 1, 0)), control_spec=0, nstep=1)
ArgumentError: length replicas of control = 3: must be 2, as in initial_state
>>> langevin.rollout([data], starts, np.zeros((2, 1, 7)), control_spec=0, nstep=1)
InputError: control has shape (2, 1, 7): must have shape (replicas, 1, 0)
>>> langevin.rollout([data], starts, None, control_spec=2**63, nstep=1)
ArgumentError: control_spec = 9223372036854775808: must be at most 32767
>>> langevin.rollout([data], starts, None, control_spec=0, nstep=10**9)
ArgumentError: nstep = 1000000000: must be at most 100000000

# Lost states
>>> model = slides('stiffness="1650" damping="0.1"', timestep=0.05, gravity=-9.81)
>>> langevin = mm.Langevin(model, kT=1)
>>> langevin.step(mujoco.MjData(model), 10_000)
FloatingPointError: the state was lost at t = ...: the timestep is too long, or dipoles came too
    close to each other
>>> sampled(langevin, 10_000, replicas=3, record_interval=10)
LangevinDiverged: replica 0 was lost at t = ..., and 2 others later or elsewhere: the timestep is
    too long (see largest_timestep, also where limits and contacts act), dipoles came too close to
    each other, or nothing bounds the energy from below; `dataset` contains what was recorded
>>> model = slides('damping="1" limited="true" range="-1 0.5"')
>>> langevin, data = mm.Langevin(model, kT=1), mujoco.MjData(model)
>>> data.qpos[0], data.qfrc_applied[0] = 1.0, math.inf
>>> langevin.step(data)
FloatingPointError: the state was lost at t = 0.002: the timestep is too long, or dipoles came too
    close to each other
>>> langevin.forces(data)
ArgumentError: forces = [nan]: must be finite, and so must be positions and applied forces in data
>>> langevin.largest_timestep(data)
ArgumentError: forces = [nan]: must be finite, and so must be positions and applied forces in data
>>> langevin = mm.Langevin(model, kT=1, splitting="o-step-o", friction=1.0)
>>> data.qfrc_applied[0] = 1e300
>>> langevin.step(data)
FloatingPointError: the state was lost at t = 0.004: the timestep is too long, or dipoles came too
    close to each other
>>> model = slides("", "")
>>> data = mujoco.MjData(model)
>>> data.qvel[0] = math.inf
>>> mm.Langevin(model).step(data, 5)
FloatingPointError: the state was lost at t = 0.002: the timestep is too long, or dipoles came too
    close to each other

# Records that remember their start
>>> langevin = mm.Langevin(slides('damping="4e-5"', timestep=0.005), kT=1)
>>> run = sampled(langevin, 4000, 4000, record_interval=10)
UserWarning: joint 'j0': on average, the records still contain 99.8 % of the energy with which its
    motion starts, the same in all replicas, so that their mean is not that of equilibrium and
    their spread is not its error; friction damps it at 4e-05 per s: a burn_in of 5.8e+04 s
    (1.2e+07 steps) leaves 1 % (by small motions about the initial position)
>>> model = slides(*['damping="1e3"'] * 7, 'damping="1e-4"', *['damping="1e3"'] * 493)
>>> run = sampled(mm.Langevin(model, kT=1), 10)
UserWarning: joint 'j7': on average, the records still contain 100 % of the energy with which its
    motion starts, the same in all replicas, so that their mean is not that of equilibrium and
    their spread is not its error; friction damps it at 0.0001 per s: a burn_in of 2.3e+04 s
    (1.2e+07 steps) leaves 1 % (by small motions about the initial position)
>>> run = sampled(mm.Langevin(slides('damping="1e6"'), kT=1), 200)
UserWarning: joint 'j0': on average, the records still contain 68.7 % of the energy with which its
    motion starts, the same in all replicas, so that their mean is not that of equilibrium and
    their spread is not its error; friction damps it at 1e+06 per s, too strongly for the rule of
    part O to follow in fewer steps: a burn_in of 2.3 s (1.2e+03 steps) leaves 1 % (by small
    motions about the initial position)
>>> langevin = mm.Langevin(slides('stiffness="1" damping="20"', timestep=0.05), kT=1)
>>> run = sampled(langevin, 200, record_interval=4)
UserWarning: joint 'j0': on average, the records still contain 62.6 % of the energy with which its
    motion starts, the same in all replicas, so that their mean is not that of equilibrium and
    their spread is not its error; friction damps it at 20 per s, too strongly for its position to
    follow in fewer steps: a burn_in of 46 s (9.2e+02 steps) leaves 1 % (by small motions about
    the initial position)
>>> langevin = mm.Langevin(slides('damping="1"', timestep=0.05), kT=1e-4)
>>> hot = mujoco.MjData(langevin.model)
>>> hot.qvel[:] = 1.0
>>> run = sampled(langevin, 100, 50, record_interval=10, initial=hot, replicas=400)
UserWarning: joint 'j0': on average, the records still contain 0.0392 % of the energy with which
    its motion starts (of about 1e+04 times kT for each degree of freedom), the same in all
    replicas, so that their mean is not that of equilibrium and their spread is not its error;
    friction damps it at 1 per s: a burn_in of 7 s (1.4e+02 steps) leaves 0.0001 % (by small
    motions about the initial position)
>>> driven, held = ('stiffness="-1" damping="20"', 'stiffness="1" damping="20"')
>>> langevin = mm.Langevin(slides(driven, held, timestep=0.05), kT=1)
>>> data = mujoco.MjData(langevin.model)
>>> data.qpos[0] = 0.9
>>> run = sampled(langevin, 10, 20, initial=data)
UserWarning: joint 'j1': on average, the records still contain 88 % of the energy with which its
    motion starts, the same in all replicas, so that their mean is not that of equilibrium and
    their spread is not its error; friction damps it at 20 per s, too strongly for its position to
    follow in fewer steps: a burn_in of 46 s (9.2e+02 steps) leaves 1 % (by small motions about
    the initial position)

# Without kT
>>> model = lone()
>>> mm.Langevin(model, splitting="obabo")
ArgumentError: splitting = 'obabo': needs kT: without it, the noise is the model's
>>> mm.Langevin(model, friction=1.0)
ArgumentError: friction = 1.0: needs kT: without it, the noise is the model's
>>> mm.Langevin(model, seed=3)
ArgumentError: seed = 3: needs kT: without it, the noise is the model's
>>> mm.Langevin(model, path=mm.noise.BrownianPath(1, 0.002))
ArgumentError: path = BrownianPath(seed=1, timestep=0.002, factor=1, level=0, hold=1,
    window=None): needs kT: without it, the noise is the model's
>>> langevin, data = mm.Langevin(model), mujoco.MjData(model)
>>> exchanged = langevin.step(data, 10)
>>> langevin.forces(data)
ArgumentError: kT = None: must be given for this: without kT, Langevin only takes steps
>>> langevin.largest_timestep(data)
ArgumentError: kT = None: must be given for this: without kT, Langevin only takes steps

# Options and flags without kT
>>> mm.Langevin(lone("<option", '<option density="1"'))
ArgumentError: option density = 1.0: must be set to zero, since drag by the square of the velocity
    has no law of fluctuation and dissipation (with kT, Langevin takes other bodies, too, but not
    the noise of the model)
>>> mm.Langevin(lone("<option", '<option viscosity="1"'))
ArgumentError: option viscosity = 1.0: must be zero without kT: the noise of a fluid is not that
    of `user` (with kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone("/>\n  <size", '><flag sleep="enable"/></option>\n  <size'))
ArgumentError: flag sleep = 'enable': must be 'disable' (with kT, Langevin takes other bodies,
    too, but not the noise of the model)
>>> mm.Langevin(lone("/>\n  <size", '><flag override="enable"/></option>\n  <size'))
ArgumentError: flag override = 'enable': must be 'disable': give solref, solimp, margin and
    friction to each geom or pair (disable=['contact'] lets Langevin ignore this; with kT,
    Langevin takes other bodies, too, but not the noise of the model)

# Actuators, equalities and tendons without kT
>>> mm.Langevin(lone("</mujoco>", '<actuator><motor joint="x"/></actuator></mujoco>'))
ArgumentError: number of actuators = 1: must be zero without kT (disable=['actuation'] lets
    Langevin ignore this; with kT, Langevin takes other bodies, too, but not the noise of the
    model)
>>> joined = lone("</mujoco>", '<equality><joint joint1="x"/></equality></mujoco>')
>>> mm.Langevin(joined)
ArgumentError: number of equalities = 1: must be zero without kT (disable=['equality'] lets
    Langevin ignore this; with kT, Langevin takes other bodies, too, but not the noise of the
    model)
>>> mm.Langevin(joined, disable=["equality"])
>>> mm.Langevin(lone('name="rope"', 'name="rope" stiffness="2"'))
ArgumentError: tendon 'rope': stiffness = 2.0: must be zero, or disabled by the flag spring (with
    kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('name="rope"', 'name="rope" frictionloss="2"'))
ArgumentError: tendon 'rope': frictionloss = 2.0: must be zero (disable=['frictionloss'] lets
    Langevin ignore this; with kT, Langevin takes other bodies, too, but not the noise of the
    model)
>>> mm.Langevin(lone('name="rope"', 'name="rope" armature="2"'))
ArgumentError: tendon 'rope': armature = 2.0: must be zero (with kT, Langevin takes other bodies,
    too, but not the noise of the model)
>>> mm.Langevin(lone('name="rope"', 'name="rope" limited="true" range="0 1"'))
ArgumentError: tendon 'rope': limited = True: must be False (disable=['limit'] lets Langevin
    ignore this; with kT, Langevin takes other bodies, too, but not the noise of the model)
>>> wire = '<spatial name="wire" damping="1"><site site="a"/><site site="b"/></spatial>'
>>> mm.Langevin(lone("</tendon>", f"{wire}</tendon>"))
ArgumentError: tendon 'wire': damping = 1.0: must be zero without kT, unless the tendon is a fixed
    one (with kT, Langevin takes other bodies, too, but not the noise of the model)

# Bodies without kT
>>> hat = '<body name="hat">{}<geom/></body>'
>>> mm.Langevin(lone('<geom name="head"/>', hat.format('<joint type="hinge"/>')))
ArgumentError: body 'hat': parent = "body 'top'": must be the world or fixed to it (with kT,
    Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('<geom name="head"/>', hat.format("")))
ArgumentError: body 'hat': parent = "body 'top'": must be the world or fixed to it (with kT,
    Langevin takes other bodies, too, but not the noise of the model)
>>> fly = '<body name="fly"><joint/><geom/></body>'
>>> mm.Langevin(lone('mocap="true"/>', f'mocap="true">{fly}</body>'))
ArgumentError: body 'fly': parent = "body 'lamp'": must be the world or fixed to it (with kT,
    Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('diaginertia="1 1 1.5"', 'fullinertia="1 1 1.5 0.1 0 0"'))
ArgumentError: inertia between joint 'spin' = 0.10000000000000087: must be zero: put slides at
    right angles, and align the frames of bodies on ball joints with their principal axes (with
    kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone(ROWS, "0 0 0 1 0 0  0 0 0 0 2 0  0 0 0 0 0 1"))
ArgumentError: body 'top': user = [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 2.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]: since the moments of inertia differ, Brownian torques must be
    three successive rows of equal torques about x, y and z (0 0 0 a 0 0, 0 0 0 0 a 0, 0 0 0 0 0
    a) (with kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone(ROWS, "1 0 0 1 0 0  0 0 0 0 1 0  0 0 0 0 0 1"))
ArgumentError: body 'top': user = [[1.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]: since the moments of inertia differ, Brownian torques must be
    three successive rows of equal torques about x, y and z (0 0 0 a 0 0, 0 0 0 0 a 0, 0 0 0 0 0
    a) (with kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone(ROWS, "0 0 0 1 0 0  1 0 0 0 0 0  0 0 0 0 1 0  0 0 0 0 0 1"))
ArgumentError: body 'top': user = [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]: since the moments of inertia
    differ, Brownian torques must be three successive rows of equal torques about x, y and z (0 0
    0 a 0 0, 0 0 0 0 a 0, 0 0 0 0 0 a) (with kT, Langevin takes other bodies, too, but not the
    noise of the model)

# Joints without kT
>>> mm.Langevin(lone('name="x"', 'name="x" stiffness="2"'))
ArgumentError: joint 'x': stiffness = 2.0: must be zero, or disabled by the flag spring (with kT,
    Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('name="x"', 'name="x" damping="1 2"'))
ArgumentError: joint 'x': dampingpoly = [2.0, 0.0]: damping that depends on velocity has no law of
    fluctuation and dissipation: make it zero or disable the flag damper (disable=['damper'] lets
    Langevin ignore this; with kT, Langevin takes other bodies, too, but not the noise of the
    model)
>>> mm.Langevin(lone('name="x"', 'name="x" range="0 1" limited="true"'))
ArgumentError: joint 'x': limited = True: must be False (disable=['limit'] lets Langevin ignore
    this; with kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('name="turn"', 'name="turn" frictionloss="2"'))
ArgumentError: joint 'turn': frictionloss = 2.0: must be zero (disable=['frictionloss'] lets
    Langevin ignore this; with kT, Langevin takes other bodies, too, but not the noise of the
    model)
>>> up = '<joint name="up" type="hinge" axis="0 0 1"/>'
>>> mm.Langevin(lone('<joint name="turn"', f'{up}<joint name="turn"'))
ArgumentError: body 'disk': joints = ['slide', 'hinge', 'hinge']: must be slides, followed by at
    most one hinge, ball or free joint (with kT, Langevin takes other bodies, too, but not the
    noise of the model)
>>> sideways = '<joint name="y" type="slide" axis="0 1 0"/>'
>>> mm.Langevin(lone('<geom name="rim"/>', f'{sideways}<geom name="rim"/>'))
ArgumentError: body 'disk': joints = ['slide', 'hinge', 'slide']: must be slides, followed by at
    most one hinge, ball or free joint (with kT, Langevin takes other bodies, too, but not the
    noise of the model)
>>> skew = '<joint name="skew" type="slide" axis="1 1 0"/>'
>>> mm.Langevin(lone('<joint name="turn"', f'{skew}<joint name="turn"'))
ArgumentError: inertia between joint 'x' and joint 'skew' = 2.961921958772244: must be zero: put
    slides at right angles, and align the frames of bodies on ball joints with their principal
    axes (with kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('axis="0 -1 0"/>', 'axis="0 -1 0" pos="0 0 0.01"/>'))
ArgumentError: joint 'turn': pos = [0.0, 0.0, 0.01]: must be at the center of mass, [0.0, 0.0,
    0.0] (with kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('pos="0 0 0" mass="1"', 'pos="0 0 0.1" mass="1"'))
ArgumentError: joint 'spin': pos = [0.0, 0.0, 0.0]: must be at the center of mass, [0.0, 0.0, 0.1]
    (with kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('name="spin"', 'name="spin" armature="1"'))
ArgumentError: joint 'spin': armature = 1.0: must be zero: armature does not rotate with the body
    (with kT, Langevin takes other bodies, too, but not the noise of the model)

# Viscous contacts without kT
>>> mm.Langevin(lone("1e6 1e6 0", "1 1 0"))
ArgumentError: contact of pair 'slip' = 'not viscous': must be a viscous one (mm.ViscousContact)
    without kT (disable=['contact'] lets Langevin ignore this; with kT, Langevin takes other
    bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('condim="3"', 'condim="4"'))
ArgumentError: contact of geom 'floor' and geom 'rim' = 'condim 4, friction 1e+06, solimp [0.0001,
    0.0001, 0.001, 0.5, 2.0], solreffriction [0.0, -1000000000000.0], cone elliptic': a viscous
    contact must have condim 3, friction 1e+06, solreffriction "0 -b", a constant solimp and an
    elliptic cone (disable=['contact'] lets Langevin ignore this; with kT, Langevin takes other
    bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('cone="elliptic"', 'cone="pyramidal"'))
ArgumentError: contact of geom 'floor' and geom 'rim' = 'condim 3, friction 1e+06, solimp [0.0001,
    0.0001, 0.001, 0.5, 2.0], solreffriction [0.0, -1000000000000.0], cone pyramidal': a viscous
    contact must have condim 3, friction 1e+06, solreffriction "0 -b", a constant solimp and an
    elliptic cone (disable=['contact'] lets Langevin ignore this; with kT, Langevin takes other
    bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('"0 -1e12"', '"-1 -1e12"'))
ArgumentError: contact of geom 'floor' and geom 'rim' = 'condim 3, friction 1e+06, solimp [0.0001,
    0.0001, 0.001, 0.5, 2.0], solreffriction [-1.0, -1000000000000.0], cone elliptic': a viscous
    contact must have condim 3, friction 1e+06, solreffriction "0 -b", a constant solimp and an
    elliptic cone (disable=['contact'] lets Langevin ignore this; with kT, Langevin takes other
    bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('impratio="1e-14"', 'impratio="1"'))
ArgumentError: pair 'slip': R/A = 952.2857142857142: must be at least 1e+06: decrease the option
    impratio (disable=['contact'] lets Langevin ignore this; with kT, Langevin takes other bodies,
    too, but not the noise of the model)
>>> mm.Langevin(lone('pos="0 0 0.1"', 'pos="0 0 0.2"'))
ArgumentError: pair 'slip': active contacts at qpos0 = 0: must be exactly one (disable=['contact']
    lets Langevin ignore this; with kT, Langevin takes other bodies, too, but not the noise of the
    model)
>>> slope = '<joint name="x" type="slide" axis="1 0 1"/>'
>>> mm.Langevin(lone('<joint name="x" type="slide" axis="1 0 0"/>', slope))
ArgumentError: pair 'slip': body 'disk' = 'free to leave the plane': must be held at a fixed
    height, since the contact bears no load (disable=['contact'] lets Langevin ignore this; with
    kT, Langevin takes other bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('name="rim"', 'name="rim" pos="0 0.01 0" mass="0"/><geom mass="1"'))
ArgumentError: geom 'rim': pos = [0.0, 0.01, 0.0]: must be at its body's center of mass, [0.0,
    0.0, 0.0] (disable=['contact'] lets Langevin ignore this; with kT, Langevin takes other
    bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('name="rim"', 'name="rim" type="capsule"'))
ArgumentError: geom 'floor' and geom 'rim': types = ['plane', 'capsule']: must be a fixed plane
    and a sphere (disable=['contact'] lets Langevin ignore this; with kT, Langevin takes other
    bodies, too, but not the noise of the model)
>>> mm.Langevin(lone('geom2="rim"', 'geom2="head"'))
ArgumentError: body 'top': moments of inertia = [1.0, 1.0, 1.5]: must be equal, since pair 'slip'
    acts on it (disable=['contact'] lets Langevin ignore this; with kT, Langevin takes other
    bodies, too, but not the noise of the model)
>>> touching = 'contype="1" conaffinity="1"'
>>> mm.Langevin(lone('contype="0" conaffinity="0"', touching))
ArgumentError: contact of geom 'floor' and geom 'head' = 'not viscous': must be a viscous one
    (mm.ViscousContact) without kT (disable=['contact'] lets Langevin ignore this; with kT,
    Langevin takes other bodies, too, but not the noise of the model)

# Samples by the Metropolis algorithm
>>> locked = cart(equality='<joint name="lock" joint1="rail"/>')
>>> mm.metropolis(locked, 1.0)
ArgumentError: equality 'lock': potential = 'unknown': must be known; disable the flag equality or
    pass `potential`
>>> biceps = '<muscle name="biceps" joint="pin" lengthrange="-1 1"/>'
>>> mm.metropolis(cart(actuator=biceps), 1.0)
ArgumentError: model = "actuator 'biceps'": the bias of its force must be affine; disable the flag
    actuation, or pass `potential`
>>> servo = '<position name="servo" joint="pin" kp="1" ctrlrange="1 2"/>'
>>> mm.metropolis(cart(actuator=servo), 1.0)
ArgumentError: model = "actuator 'servo'": the range of its control must contain zero; disable the
    flag actuation, or pass `potential`
>>> mm.metropolis(cart(box=TOUCHING, floor=TOUCHING), 1.0)
ArgumentError: geom 'floor' and geom 'box': potential = 'unknown': must be known; disable the flag
    contact or pass `potential`
>>> run = mm.metropolis(
...     cart("contact", box=TOUCHING, floor=TOUCHING), 1.0, samples=1, burn_in=0
... )
>>> model = slides('stiffness="1"', 'stiffness="1"')
>>> mm.metropolis(model, 0.0)
ArgumentError: kT = 0.0: must be greater than 0
>>> mm.metropolis(model, -1.0)
ArgumentError: kT = -1.0: must be greater than 0
>>> mm.metropolis(model, math.nan)
ArgumentError: kT = nan: must be a finite number
>>> mm.metropolis(model, 1.0, initial=np.zeros((3, 2)))
ArgumentError: shape of initial = (3, 2): must be (16, 2)
>>> mm.metropolis(model, 1.0, potential=lambda data: math.inf)
ArgumentError: initial = [0.0, 0.0]: the potential energy must be finite there
>>> mm.metropolis(model, 1.0, potential=lambda data: math.nan)
ArgumentError: potential(data) = nan: must be a number, which may be infinite where no position is
    allowed
>>> mm.metropolis(model, 1.0, potential=lambda data: "a")
ArgumentError: potential(data) = 'a': must be a number, which may be infinite where no position is
    allowed
>>> mm.metropolis(model, 1.0, samples=10**8, replicas=10**8)
ArgumentError: samples = 100000000: 100000000 x 100000000 records do not fit in memory
>>> mm.metropolis(load("<mujoco/>"), 1.0)
ArgumentError: number of joints = 0: must be at least 1

# Temperatures of runs
>>> model = load(DOUBLE)
>>> mm.kinetic_temperature(model, records().drop_vars("qpos"))
ArgumentError: variables of run = ['qvel']: must contain 'qpos'
>>> mm.kinetic_temperature(model, records(qpos=(("time", "nq"), np.zeros((20, 3)))))
InputError: qpos of run has shape (20, 3): must have shape (..., 2)
>>> mm.kinetic_temperature(model, records(qpos=(("other", "nq"), np.zeros((19, 2)))))
ArgumentError: shapes of run = [(1, 19), (1, 20)]: all variables must have the same times
>>> mm.kinetic_temperature(model, records(qpos=(("time", "nq"), np.full((20, 2), np.nan))))
InputError: qpos of run contains nan: every value must be finite and at most 1e+30 in magnitude
>>> mm.kinetic_temperature(model, records().isel(time=slice(15)))
ArgumentError: number of records of run = 15: must be at least 16
>>> empty = {name: (("r", "t", "n"), np.ones((0, 9, 2))) for name in ("qpos", "qvel")}
>>> mm.kinetic_temperature(model, xr.Dataset(empty))
ArgumentError: number of records of run = 0: must be at least 16
>>> mm.configurational_temperature(model, records(), lambda data: np.ones(3))
InputError: forces(data) has shape (3,): must have shape (2,)
>>> mm.configurational_temperature(model, records(), lambda data: "a")
ArgumentError: forces(data) = 'a': must be an array of numbers
>>> mm.configurational_temperature(model, records(), lambda data: np.ones(2))
ArgumentError: divergences of forces at the positions of run = 0.0: must not be zero everywhere:
    some force must depend on the position
>>> mm.configurational_temperature(model, records(qfrc_applied=("n", np.zeros(3))))
InputError: qfrc_applied of run has shape (3,): must have shape (2,)
>>> model.opt.gravity[:] = 0
>>> mm.configurational_temperature(model, records())
ArgumentError: forces at the positions of run = 0.0: must not be zero everywhere: some force must
    depend on the position
>>> floor = "<worldbody><geom name='floor' type='plane' size='1 1 1'/>"
>>> hand = "<geom name='hand' size='0.1' condim='3'/><inertial"
>>> rubbing = DOUBLE.replace("<worldbody>", floor).replace("<inertial", hand, 1)
>>> mm.configurational_temperature(load(rubbing), records())
InputError: geom 'floor' and geom 'hand': the contact has friction, which has no potential;
    disable the flag contact
>>> model = slides('stiffness="1" damping="5" limited="true" range="-9 9"')
>>> run = sampled(mm.Langevin(model, kT=0.5, disable=["limit"]), 2000)
UserWarning: joint 'j0': on average, the records still contain 49.4 % of the energy with which its
    motion starts, the same in all replicas, so that their mean is not that of equilibrium and
    their spread is not its error; friction damps it at 5 per s, too strongly for its position to
    follow in fewer steps: a burn_in of 11 s (5.7e+03 steps) leaves 1 % (by small motions about
    the initial position)
>>> mm.configurational_temperature(model, run)
ArgumentError: model = <mujoco...MjModel object at 0x...>: must be the effective_model of the
    Langevin that made this run, since it disabled flags or softened constraints
"""
