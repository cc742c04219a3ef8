"""Brownian paths, and the noise of models."""

import math
from tempfile import TemporaryDirectory

import mujoco

import magmotor as mm
from magmotor.noise import COARSEST, BrownianPath

TREE = """
<mujoco>
  <option gravity="0 0 0" {option}/>
  <custom><text name="magmotor" data="noise"/></custom>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    {floor}
    <body name="base" pos="0 0 1">
      {base}
      <geom type="box" size="0.1 0.05 0.02"/>
      <geom size="0.02" pos="0.1 0.02 0.01" mass="0" {shape}/>
      <body name="link" pos="0.2 0 0">
        <joint name="elbow" axis="1 2 0" pos="0.01 0 0" {elbow}/>
        <geom type="capsule" size="0.02 0.1" pos="0.02 0.01 0.1" {link}/>
      </body>
    </body>
    <body name="other" pos="0 0.5 1">
      <joint name="pivot" axis="0 0.3 1" pos="0.04 0.02 0" {pivot}/>
      <geom type="capsule" size="0.03 0.08"/>
    </body>
  </worldbody>
  <tendon>{tendon}</tendon>
  <actuator>{actuator}</actuator>
</mujoco>
"""
PARTS = ("option", "floor", "shape", "elbow", "link", "pivot", "tendon", "actuator")
HINGE = '<joint name="axle" axis="0 1 0" damping="0.3" pos="0.03 0 0"/>'
SLIDES = (
    '<joint name="x" type="slide" axis="1 0 0" damping="0.2"/>'
    '<joint type="slide" damping="0.3"/><joint name="y" pos="1 0 0"/>'
)
HINGES = '<joint name="x" axis="1 0 0"/><joint name="y" axis="0 1 0" damping="1"/>'
TENDON = """<fixed name="cord" {}>
<joint joint="{}" coef="2"/><joint joint="pivot" coef="1"/></fixed>"""
FLOOR = "<geom name='floor' type='plane' size='1 1 1' contype='3' conaffinity='3' condim='{}'/>"

NEEDLE = """
<mujoco>
  <size nuserdata="5"/>
  <custom><text name="magmotor" data="noise"/></custom>
  <worldbody>
    <body name="needle" user="0 0 0 0 0 2e-6">
      <joint type="hinge" axis="0 0 1" damping="2e-6"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
    </body>
  </worldbody>
</mujoco>
"""


def tree(base="<freejoint/>", **parts) -> mujoco.MjModel:
    """Return two trees with changed parts."""
    return mujoco.MjModel.from_xml_string(
        TREE.format(**dict.fromkeys(PARTS, "") | {"base": base} | parts)
    )


def needle(*userdata: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a needle with noise, and data with these first `userdata`."""
    model = mujoco.MjModel.from_xml_string(NEEDLE)
    data = mujoco.MjData(model)
    data.userdata[: len(userdata)] = userdata
    return model, data


def step_needle(*userdata: float) -> None:
    """Step it once, while magnetism acts."""
    with mm.magnetism():
        mujoco.mj_step(*needle(*userdata))


TABLE = r"""
# Brownian paths
>>> BrownianPath(-1, 1.0)
ArgumentError: seed = -1: must be at least 0
>>> BrownianPath(2**53, 1.0)
ArgumentError: seed = 9007199254740992: must be less than 2^53 = 9007199254740992
>>> BrownianPath(1.5, 1.0)
ArgumentError: seed = 1.5: must be an integer
>>> BrownianPath(1, 0.0)
ArgumentError: timestep = 0.0: must be greater than 0 s
>>> BrownianPath(1, 1e30).coarsened(8)
ArgumentError: timestep = 8e+30: must be from 1e-30 to 1e+30 in magnitude
>>> BrownianPath(1, 1e-30).refined()
ArgumentError: timestep = 5e-31: must be from 1e-30 to 1e+30 in magnitude

# Other timesteps of a path
>>> path = BrownianPath(1, 1.0)
>>> path.coarsened(0)
ArgumentError: factor = 0: must be at least 1
>>> path.coarsened(2**53)
ArgumentError: factor = 9007199254740992: must be at most 2147483648
>>> path.coarsened(10**40)
ArgumentError: factor = 10000000000000000000000000000000000000000: must be at most 2147483648
>>> path.coarsened(COARSEST).coarsened(2)
ArgumentError: factor = 33554432: must be at most 16777216
>>> path.refined(2).coarsened(3)
ArgumentError: factor = 3: must be a power of 2 up to 2^2 for this refined path
>>> path.coarsened(3).refined()
ArgumentError: halvings = 1: 2^halvings must divide 3
>>> path.refined(40)
ArgumentError: halvings = 40: must be at most 31
>>> path.refined(2**53)
ArgumentError: halvings = 9007199254740992: must be at most 31
>>> path.refined(20).refined(20)
ArgumentError: level = 40: must be at most 31

# Increments
>>> path = BrownianPath(1, 1.0)
>>> path.increments(-1)
ArgumentError: steps = -1: must be at least 0
>>> path.increments(1.5)
ArgumentError: steps = 1.5: must be an integer
>>> path.increments(2**50)
ArgumentError: steps = 1125899906842624: the increments do not fit in memory
>>> path.increments(1, first=-1)
ArgumentError: first = -1: must be at least 0
>>> path.increments(1, first=2**53)
ArgumentError: first = 9007199254740992: must be at most 9007199254740991 for 1 step of this path
>>> path.coarsened(COARSEST).increments(1, first=2**29)
ArgumentError: first = 536870912: must be at most 536870911 for 1 step of this path
>>> path.increments(1, replica=2**53)
ArgumentError: replica = 9007199254740992: must be at most 9007199254740991
>>> path.increments(1, channel=2**32)
ArgumentError: channel = 4294967296: must be at most 4294967295

# Held paths
>>> path = BrownianPath(seed=3, timestep=0.25)
>>> path.held(0)
ArgumentError: steps = 0: must be at least 1
>>> path.held(2**25)
ArgumentError: steps = 33554432: must be at most 16777216
>>> path.held(2, 0)
ArgumentError: window = 0: must be at least 1
>>> path.held(2, 2**25)
ArgumentError: window = 33554432: must be at most 16777216
>>> path.held(2).held(3)
ArgumentError: steps = 3: must not be given twice: this path is held already
>>> path.coarsened(2).held(3)
ArgumentError: hold = 3: must be 1, without a window, if the path is coarsened or refined
>>> path.refined().held(1, 2)
ArgumentError: hold = 1: must be 1, without a window, if the path is coarsened or refined
>>> path.held(6).coarsened(4)
ArgumentError: factor = 4: must divide the hold, 6 timesteps
>>> path.held(2**24).refined()
ArgumentError: hold = 33554432: must be at most 16777216

# Checkpoints of another path
>>> folder, path = TemporaryDirectory(), BrownianPath(seed=3, timestep=0.05)
>>> options = {"duration": 1.0, "checkpoint": f"{folder.name}/run.checkpoint"}
>>> run = mm.simulate(mm.Disk(), method="variational/baoab", path=path, **options)
>>> mm.simulate(mm.Disk(), method="variational/baoab", path=path.held(7, 5), **options)
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: path.hold was
    1 there and is 7 here, path.window was None there and is 5 here
>>> folder.cleanup()

# Brownian rows
>>> mm.brownian_rows(tree(elbow='damping="0.1"'), 1.0)
ArgumentError: damping of joint 'elbow' = 0.1: no wrench of the world can match it, since it acts
    between body 'base' and body 'link', which move: use mm.Langevin, which needs no rows, or the
    forces of mm.JointNoise in mj_step
>>> mm.brownian_rows(tree(HINGE, tendon=TENDON.format('damping="1"', "axle")), 1.0)
ArgumentError: damping of tendon 'cord' = 1.0: no wrench of the world can match it, since it acts
    between body 'base' and body 'other', which move: use mm.Langevin, which needs no rows, or the
    forces of mm.JointNoise in mj_step
>>> servo = '<velocity name="servo" joint="elbow" kv="2"/>'
>>> mm.brownian_rows(tree(actuator=servo), 1.0)
ArgumentError: damping of actuator 'servo' = 2.0: no wrench of the world can match it, since it
    acts between body 'base' and body 'link', which move: use mm.Langevin, which needs no rows, or
    the forces of mm.JointNoise in mj_step
>>> mm.brownian_rows(tree(HINGES), 1.0)
ArgumentError: friction of joint 'y' = 1.0: no wrench of the world can match it, since it turns
    with the body: use mm.Langevin, which needs no rows, or the forces of mm.JointNoise in mj_step
>>> mm.brownian_rows(tree(SLIDES), 1.0)
ArgumentError: friction of joint 'x' = 0.2: no wrench of the world can match it, since it turns
    with the body: use mm.Langevin, which needs no rows, or the forces of mm.JointNoise in mj_step
>>> mm.brownian_rows(tree(option='viscosity="1"', shape='fluidshape="ellipsoid"'), 1.0)
ArgumentError: friction of joint 0 = 1.30...: no wrench of the world can match it, since
    it turns with the body: use mm.Langevin, which needs no rows, or the forces of mm.JointNoise
    in mj_step
>>> model = tree(pivot='damping="1"')
>>> mm.brownian_rows(model, -1.0)
ArgumentError: kT = -1.0: must be at least 0 J
>>> model.body_mass[:] = math.inf
>>> mm.brownian_rows(model, 1.0)
InputError: body_mass of the model contains inf: every value must be finite and at most 1e+30 in
    magnitude

# Noise of joints
>>> mm.JointNoise(tree(), 1.0)
ArgumentError: friction of the model = 0: must not be zero: nothing would reach kT
>>> model = tree(pivot='damping="1"')
>>> mm.JointNoise(model, -1.0)
ArgumentError: kT = -1.0: must be at least 0 J
>>> noise, data = mm.JointNoise(model, 1.0), mujoco.MjData(model)
>>> noise.force(mujoco.MjData(tree()))
ArgumentError: data.model = <mujoco...MjModel object at 0x...>: must be the model
    of this JointNoise
>>> data.time = math.nan
>>> noise.force(data)
ArgumentError: data.time = nan: must be finite and between -2^53 and 2^53 timesteps
>>> fluid = tree(option='viscosity="1"', shape='fluidshape="ellipsoid"')
>>> data = mujoco.MjData(fluid)
>>> data.qpos[:] = math.inf
>>> mm.JointNoise(fluid, 1.0).force(data)
ArgumentError: force = [nan, nan, nan, nan, nan, nan, nan, nan]: must be finite, and so must be
    the positions in data
>>> fluid.geom_fluid[:] = math.inf
>>> mm.JointNoise(fluid, 1.0).force(mujoco.MjData(fluid))
ArgumentError: force = [nan, nan, nan, nan, nan, nan, nan, nan]: must be finite, and so must be
    the positions in data
>>> fluid.opt.viscosity = math.nan
>>> mm.JointNoise(fluid, 1.0)
ArgumentError: option viscosity = nan: must be zero or greater, and finite
>>> model.body_mass[:] = math.inf
>>> mm.JointNoise(model, 1.0)
InputError: body_mass of the model contains inf: every value must be finite and at most 1e+30 in
    magnitude

# Dry friction has no noise
>>> noise = mm.JointNoise(tree(elbow='damping="0.1" frictionloss="0.1"'), 1.0)
UserWarning: joint 'elbow': dry friction has no noise, so that the temperature will be too low;
    disable the flag frictionloss, or contact, or set condim=1
>>> damped = {"elbow": 'damping="0.1"'}
>>> cord = TENDON.format('damping="1" frictionloss="0.1"', "elbow")
>>> noise = mm.JointNoise(tree(tendon=cord, **damped), 1.0)
UserWarning: tendon 'cord': dry friction has no noise, so that the temperature will be too low;
    disable the flag frictionloss, or contact, or set condim=1
>>> touching = {"link": 'contype="1"', "shape": 'contype="1"', **damped}
>>> noise = mm.JointNoise(tree(floor=FLOOR.format(3), **touching), 1.0)
UserWarning: geom 'floor' and geom 2 of body 'base', and 1 more: dry friction has no noise, so
    that the temperature will be too low; disable the flag frictionloss, or contact, or set
    condim=1
>>> frictionless = {name: f'{text} condim="1"' for name, text in touching.items() if "con" in text}
>>> noise = mm.JointNoise(tree(floor=FLOOR.format(1), **damped, **frictionless), 1.0)

# The numbers that select a path
>>> step_needle(math.nan)
FatalError: userdata[0] = nan: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> step_needle(0.5)
FatalError: userdata[0] = 0.5: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> step_needle(-1.5)
FatalError: userdata[0] = -1.5: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> step_needle(2.0**53)
FatalError: userdata[0] = 9.0072e+15: the numbers that select the noise (seed, replica, factor,
    level, first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at
    most 31, or 32 plus the window for a held path
>>> step_needle(math.inf)
FatalError: userdata[0] = inf: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> step_needle(0, 0.5)
FatalError: userdata[1] = 0.5: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> step_needle(0, 0, -1.0)
FatalError: userdata[2] = -1: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> step_needle(0, 0, 0, 2.0**25)
FatalError: userdata[3] = 3.35544e+07: the numbers that select the noise (seed, replica, factor,
    level, first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at
    most 31, or 32 plus the window for a held path
>>> step_needle(0, 0, 0, 1.5)
FatalError: userdata[3] = 1.5: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> step_needle(0, 0, 0, 0, math.nan)
FatalError: userdata[4] = nan: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> model, data = needle(1e300)
>>> mm.Langevin(model).step(data)
FatalError: userdata[0] = 1e+300: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> model.body_user[:] = 0
>>> with mm.magnetism():
...     mujoco.mj_step(model, data)
UserWarning: nothing acts on this model: it has no dipole sites (a site with user="MOMENT" in A
    m^2, along its z axis); Brownian wrenches and potentials need a mark and user numbers of
    bodies or joints
"""
