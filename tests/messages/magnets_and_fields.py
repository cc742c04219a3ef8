"""Magnets, dipoles, tabulated fields, `mm.check` and temperatures of models, and levitation."""

import math

import gymnasium
import mujoco
import numpy as np

import magmotor as mm
from magmotor.gym.levitation import Levitation, LevitationVector

MUJOCO = """
<mujoco>
  <option timestep="0.002" {option}>{flag}</option>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" contype="{contact}" conaffinity="{contact}"/>
    <site pos="0 0 1" user="{moment}"/>
    <body pos="0 0 0.2">
      <joint name="pan" axis="0 0 1" damping="0.1" armature="0.003" {joint}/>
      <geom size="0.02" mass="0.1" contype="0"/>
      <body name="link">
        <joint name="lift" axis="0 1 0" damping="0.1"/>
        <geom type="capsule" fromto="0 0 0 1 0 0" size="0.02" mass="1" condim="1"
          contype="{contact}"/>
        <site user="{moment}" pos="0.1 0 0"/>
      </body>
    </body>
  </worldbody>
  {more}
</mujoco>"""
LIMIT = """<tendon><fixed limited="true" range="-0.16 0.16"><joint joint="pan" coef="2"/></fixed>
</tendon>"""
EQUALITY = '<equality><joint joint1="pan" polycoef="0.05 0 0 0 0"/></equality>'
NAME = "magmotor/Levitation-v0"


def magnet(shape="cuboid", size=(0.01, 0.01, 0.01), grade="N42", **changed):
    """Return a magnet some of whose arguments are changed."""
    return mm.magnet(shape, size, grade=grade, **changed)


def model(**changed):
    """Return a model of an arm with a magnet, some of whose parts are changed."""
    parts = {"option": "", "flag": "", "contact": 0, "moment": 0, "joint": "", "more": ""}
    return mujoco.MjModel.from_xml_string(MUJOCO.format(**parts | changed))


def data(model, **changed):
    """Return data some of whose numbers are changed."""
    found = mujoco.MjData(model)
    for name, value in changed.items():
        getattr(found, name)[0] = value
    return found


def reordered(field, value):
    """Return a model whose parts are not in order."""
    found = model()
    getattr(found, field)[0] = value
    return found


TABLE = r"""
# Magnets
>>> magnet("cube")
ArgumentError: shape = 'cube': must be one of cuboid, cylinder, ring, sphere (did you mean
    'cuboid'?)
>>> magnet(grade="N41")
ArgumentError: grade = 'N41': must be one of N35, N38, N40, N42, N45, N48, N50, N52, SmCo18,
    SmCo22, SmCo26, SmCo28, SmCo32, C1, C5, C8, AlNiCo5, AlNiCo8 (did you mean 'N48'?)
>>> magnet(size=0.01)
ArgumentError: size = (0.01,): must be (edge along x, edge along y, edge along z) in m, for a
    cuboid
>>> magnet(size=(1, 1))
ArgumentError: size = (1.0, 1.0): must be (edge along x, edge along y, edge along z) in m, for a
    cuboid
>>> magnet(size=(1, 1, 0))
ArgumentError: size[2] (edge along z) = 0.0: must be greater than 0 m
>>> magnet(size=(1, math.nan, 1))
InputError: size contains nan: every value must be finite and at most 1e+30 in magnitude
>>> magnet(size="big")
ArgumentError: size = 'big': must be an array of numbers
>>> magnet("cylinder", (1, 1, 1))
ArgumentError: size = (1.0, 1.0, 1.0): must be (diameter, height) in m, for a cylinder
>>> magnet("ring", (1, 1))
ArgumentError: size = (1.0, 1.0): must be (inner diameter, outer diameter, height) in m, for a
    ring
>>> magnet("ring", (2, 1, 1))
ArgumentError: size = (2.0, 1.0, 1.0): must be (inner diameter, outer diameter, height) in m, for
    a ring, the first smaller than the second
>>> magnet("sphere", (1, 1))
ArgumentError: size = (1.0, 1.0): must be one diameter in m, for a sphere
>>> magnet(remanence=1.2)
ArgumentError: remanence and grade = (1.2, 'N42'): exactly one of them must be given
>>> magnet(grade=None)
ArgumentError: remanence and grade = (None, None): exactly one of them must be given
>>> magnet(grade=None, remanence=0)
ArgumentError: remanence = 0.0: must be greater than 0 T
>>> magnet(density=-1)
ArgumentError: density = -1.0: must be greater than 0 kg/m^3
>>> magnet(direction=(0, 0, 0))
ArgumentError: direction = (0, 0, 0): must not be zero
>>> magnet(direction=(0, 1))
InputError: direction has shape (2,): must have shape (3,)
>>> magnet("cylinder", (10, 5))
UserWarning: size = (10.0, 5.0): lengths are in meters; are these millimeters?

# Accuracies of magnets
>>> magnet().dipoles(0.01, 0)
ArgumentError: gap = 0: must be greater than 0
>>> magnet().mjcf(0.01, 0)
ArgumentError: gap = 0: must be greater than 0
>>> magnet().dipoles(0.01, -1)
ArgumentError: gap = -1: must be greater than 0
>>> magnet().dipoles(0, 0.01)
ArgumentError: error = 0: must be at least 1e-06
>>> magnet().dipoles(1, 0.01)
ArgumentError: error = 1: must be less than 1
>>> magnet().mjcf(1, 0.01)
ArgumentError: error = 1: must be less than 1
>>> magnet().dipoles(0.01, 1e-4)
ArgumentError: error = 0.01: requires more than 1000 dipoles at gap = 0.0001 m: choose a larger
    error or gap; for magnets that touch, error=0.5 and gap=0.003
>>> magnet().mjcf(0.01, 1e-4)
ArgumentError: error = 0.01: requires more than 1000 dipoles at gap = 0.0001 m: choose a larger
    error or gap; for magnets that touch, error=0.5 and gap=0.003
>>> magnet().dipoles(0.01, 1.3e-3)
ArgumentError: error = 0.01: requires more than 1000 dipoles at gap = 0.0013 m: choose a larger
    error or gap; for magnets that touch, error=0.5 and gap=0.003
>>> magnet(size=(0.01, 0.01, 0.002)).dipoles(0.01, 1e-5)
ArgumentError: error = 0.01: requires more than 1000 dipoles at gap = 1e-05 m: choose a larger
    error or gap; for magnets that touch, error=0.5 and gap=0.0006
>>> magnet("cylinder", (0.01, 0.005)).dipoles(0.01, 1e-5)
ArgumentError: error = 0.01: requires more than 1000 dipoles at gap = 1e-05 m: choose a larger
    error or gap; for magnets that touch, error=0.5 and gap=0.0015

# Tabulated fields
>>> mm.tabulated_field(lambda point: [0, 0, point[2]], [0, 0, 0], [1, 1, 1], (4, 4, 5))
InputError: field(points) = [0, 0, array([0. , 0. , 0.5])]: must be an array of numbers; field is
    called once, with all points, and must return B at each, shape (80, 3)
>>> mm.tabulated_field(lambda points: points.T, [0, 0, 0], [1, 1, 1], (4, 4, 4))
InputError: field(points) has shape (3, 64): must have shape (64, 3); field is called once, with
    all points, and must return B at each, shape (64, 3)
>>> up, across = [0, 0, 1], [1, 0, 0]
>>> one_point = lambda point: up if point[2] > 0 else across
>>> mm.tabulated_field(one_point, [0, 0, 0], [1, 1, 1], (4, 4, 4))
InputError: field(points) failed (The truth value of an array ... is ambiguous. ...); field is
    called once, with all points, and must return B at each, shape (64, 3)
>>> mm.tabulated_field(lambda points: points, [0, 0, 0], [1, 1, 1], (4, 4))
ArgumentError: shape = (4, 4): must be the numbers of nodes along x, y and z

# Fields of dipoles
>>> mm.dipoles.field([0, 0], [[1, 0, 0]], [[1, 0, 0]])
InputError: points has shape (2,): must have shape (..., 3)
>>> mm.dipoles.field([0, 0, 0], [[1, 0, 0]], [[1, 0, 0], [0, 1, 0]])
InputError: positions and moments have shapes (1, 3) and (2, 3): both must be (N, 3)
>>> mm.dipoles.field([0, 0, math.nan], [[1, 0, 0]], [[1, 0, 0]])
InputError: points contains nan: every value must be finite and at most 1e+30 in magnitude
>>> mm.dipoles.field([[5, 5, 5], [1, 0, 0]], [[0, 1, 0], [1, 0, 0]], [[1, 0, 0]] * 2)
ArgumentError: points = array([1., 0., 0.]): must not coincide with dipole 1 (within 1e-09 m)
>>> mm.dipoles.field([0, 0, 9e-10], [[9, 9, 9], [0, 0, 0]], [[1, 0, 0]] * 2)
ArgumentError: points = array([0.e+00, 0.e+00, 9.e-10]): must not coincide with dipole 1 (within
    1e-09 m)

# Models and data that are checked
>>> light = "<mujoco><worldbody><body><joint/></body></worldbody></mujoco>"
>>> mm.check(mujoco.MjSpec.from_string(light))
InputError: MuJoCo cannot compile the model: Error: mass and inertia of moving bodies ...
>>> mm.check(model(), mujoco.MjData(mujoco.MjModel.from_xml_string("<mujoco/>")))
ArgumentError: shape of data.qpos = (0,): must be (2,)
>>> mm.check(model(), data(model(), qpos=math.nan))
ArgumentError: data.qpos = array([nan, 0.]): must be finite
>>> mm.check(reordered("body_dofadr", 2))
InputError: body_dofnum, body_dofadr and dof_bodyid of the model do not agree
>>> mm.check(reordered("body_jntadr", 2))
InputError: body_jntnum, body_jntadr and jnt_bodyid of the model do not agree
>>> mm.check(reordered("tree_dofadr", -1))
InputError: tree_dofnum, tree_dofadr and dof_treeid of the model do not agree
>>> mm.check(reordered("tree_dofnum", 7))
InputError: tree_dofnum, tree_dofadr and dof_treeid of the model do not agree

# Soft constraints at a temperature
>>> langevin = mm.Langevin(model(joint='range="-5 5"'), kT=0.2)
UserWarning: soft constraints are softened to suit the timestep 0.002: joint limits (1, up to ...
    times slower); take a shorter timestep, or increase their solref, to keep them as they are;
    effective_model has the potential used
>>> langevin = mm.Langevin(model(more=LIMIT), kT=0.2)
UserWarning: soft constraints are softened to suit the timestep 0.002: tendon limits (1, up to ...
    times slower); take a shorter timestep, or increase their solref, to keep them as they are;
    effective_model has the potential used
>>> langevin = mm.Langevin(model(more=EQUALITY), kT=0.2)
UserWarning: soft constraints are softened to suit the timestep 0.002: equalities (1, up to ...
    times slower); take a shorter timestep, or increase their solref, to keep them as they are;
    effective_model has the potential used
>>> overridden = model(option='o_solref="-1e8 0"', flag='<flag override="enable"/>', contact=1)
>>> mm.Langevin(overridden, kT=0.2)
ArgumentError: flag override = 'enable': must be 'disable': give solref, solimp, margin and
    friction to each geom or pair (disable=['contact'] lets Langevin ignore this;
    splitting='o-step-o' with friction=1.0 takes every model, but can be far too cold where dry
    friction acts)
>>> langevin = mm.Langevin(model(), kT=300.0)
UserWarning: kT = 300 J is an energy: 300 K would be kT = 4.14e-21 J

# Levitation
>>> Levitation().step(np.zeros(1))
ResetNeeded: call reset before step
>>> LevitationVector().step(np.zeros(1))
ResetNeeded: call reset before step
>>> LevitationVector(2).reset(options={"reset_mask": np.array([True, False])})
ResetNeeded: call reset for all environments before a part of them
>>> ball, balls = Levitation(), LevitationVector(2)
>>> start = ball.reset(seed=1), balls.reset(seed=1)
>>> ball.step(np.array([math.nan]))
InputError: action contains nan: every value must be finite and at most 1e+30 in magnitude
>>> balls.step(np.array([[0.0], [math.nan]]))
InputError: actions contains nan: every value must be finite and at most 1e+30 in magnitude
>>> ball.reset(seed=0.5)
ArgumentError: seed = 0.5: must be an integer
>>> ball.reset(seed=-1)
ArgumentError: seed = -1: must be at least 0
>>> balls.reset(seed=0.5)
ArgumentError: seed = 0.5: must be one integer, or 2 of them
>>> balls.reset(seed=[1])
ArgumentError: seed = [1]: must be one integer, or 2 of them
>>> balls.reset(options={"reset_mask": np.array([1, 0])})
ArgumentError: options["reset_mask"] = array([1, 0]): must be an array of 2 bools, one of which at
    least is True
>>> balls.reset(options={"reset_mask": np.array([False, False])})
ArgumentError: options["reset_mask"] = array([False, False]): must be an array of 2 bools, one of
    which at least is True
>>> Levitation(render_mode="human")
ArgumentError: render_mode = 'human': must be 'rgb_array' or None
>>> LevitationVector(render_mode="human")
ArgumentError: render_mode = 'human': must be 'rgb_array' or None
>>> LevitationVector(max_episode_steps=0)
ArgumentError: max_episode_steps = 0: must be at least 1
>>> gymnasium.make_vec(NAME, 0)
ArgumentError: num_envs = 0: must be at least 1
"""
