"""Viscous contacts, and magnets that collide."""

import math

import mujoco

import magmotor as mm

BALL = """
<mujoco>
  <option cone="elliptic" impratio="1e-14" timestep="0.005" integrator="RK4"/>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1"/>
    <body name="ball" pos="0 0 0.03">
      <freejoint/>
      <geom name="ball" size="0.03" density="2500"/>
    </body>
  </worldbody>
</mujoco>
"""

MAGNETS = """
<mujoco>
  {}
  <option gravity="0 0 0" timestep="2e-3"/>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>{}</worldbody>
</mujoco>
"""
PLUGIN = """<extension>
  <plugin plugin="magmotor.forces"><instance name="magnets"/></plugin>
</extension>"""
LINKED = """
<body name="one"><joint type="hinge" axis="0 1 0"/><geom size="0.005"/><site user="0.1"/>
  <body pos="0 0 .02"><joint type="hinge" axis="0 1 0"/><geom size="0.002"/>
    <body name="two" pos="0 0 -.013"><joint type="slide" axis="0 0 1"/><geom size="0.005"/>
      <site user="0.1"/></body></body></body>
"""
FREE = """
<body name="{}" pos="0 0 {}">
  <freejoint/><geom type="{}" size="0.005 0.005 0.005" density="7500"/><site user="0.54"/>
</body>
"""


def contact(**fields) -> mm.ViscousContact:
    """Return a contact of a ball with a floor, with changed fields."""
    return mm.ViscousContact(**{"damping": 0.2, "sphere": "ball", "plane": "floor"} | fields)


def model_with(old="", new="") -> mujoco.MjModel:
    """Return a model with the contact, with a changed text."""
    assert BALL.count(old) == 1 or not old
    spec = mujoco.MjSpec.from_string(BALL.replace(old, new))
    contact().add_to(spec)
    return spec.compile()


def magnets(bodies: str, *, plugin=False) -> mujoco.MjModel:
    """Return a model of magnets."""
    return mujoco.MjModel.from_xml_string(MAGNETS.format(PLUGIN * plugin, bodies))


def two(distance: float, shape="sphere", *, plugin=False) -> mujoco.MjModel:
    """Return two magnets that attract each other, with 5 mm from their centers to their sides."""
    bodies = FREE.format("one", 0, shape) + FREE.format("two", distance, shape)
    return magnets(bodies, plugin=plugin)


def steps(model: mujoco.MjModel, count: int) -> None:
    """Advance the model from its initial state, while magnetism acts."""
    with mm.magnetism():
        mujoco.mj_step(model, mujoco.MjData(model), nstep=count)


TABLE = r"""
# Fields of a viscous contact
>>> contact(damping=0.0)
ArgumentError: damping = 0.0: must be greater than 0 kg/s
>>> contact(damping=math.nan)
ArgumentError: damping = nan: must be a finite number
>>> contact(sphere=1)
ArgumentError: sphere = 1: must be an instance of str
>>> contact(plane=None)
ArgumentError: plane = None: must be an instance of str
>>> contact(bears_load=1)
ArgumentError: bears_load = 1: must be True or False

# The pair of a viscous contact
>>> model = model_with()
>>> contact().add_to(model)
ArgumentError: description = <mujoco...MjModel object at 0x...>: must be an MjSpec
    or the root of a PyMJCF tree
>>> contact(name="slip").calibrate(model)
InputError: pair 'slip' is not in the model: add it to the description with `add_to` before
    compiling the model
>>> contact(sphere="cue").calibrate(model)
ArgumentError: pair 'viscous' = "geom 'floor' and geom 'ball'": must be the pair of 'cue' and
    'floor'
>>> model.pair_friction[0, 0] = 1.0
>>> contact().calibrate(model)
ArgumentError: contact of geom 'floor' and geom 'ball' = 'condim 3, friction 1, solimp [0.9999,
    0.9999, 0.001, 0.5, 2.0], solreffriction [0.0, -1.0], cone elliptic': a viscous contact must
    have condim 3, friction 1e+06, solreffriction "0 -b", a constant solimp and an elliptic cone
>>> contact().damping_of(model)
ArgumentError: contact of geom 'floor' and geom 'ball' = 'condim 3, friction 1, solimp [0.9999,
    0.9999, 0.001, 0.5, 2.0], solreffriction [0.0, -1.0], cone elliptic': a viscous contact must
    have condim 3, friction 1e+06, solreffriction "0 -b", a constant solimp and an elliptic cone

# Models that cannot realize a viscous contact
>>> contact().calibrate(model_with('cone="elliptic"', ""))
ArgumentError: contact of geom 'floor' and geom 'ball' = 'condim 3, friction 1e+06, solimp
    [0.9999, 0.9999, 0.001, 0.5, 2.0], solreffriction [0.0, -1.0], cone pyramidal': a viscous
    contact must have condim 3, friction 1e+06, solreffriction "0 -b", a constant solimp and an
    elliptic cone
>>> contact().calibrate(model_with("1e-14", "1e-4"))
ArgumentError: option impratio = 0.0001: must be at most 2.9e-07, so that R >= 100 A
>>> box = '"ball" type="box" size="1 1 1'
>>> contact().calibrate(model_with('"ball" size="0.03', box))
ArgumentError: geom 'floor' and geom 'ball': types = ['plane', 'box']: must be a fixed plane and a
    sphere
>>> floor = '<geom name="floor" type="plane" size="9 9 1"/>'
>>> moving = f'<body mocap="true">{floor}</body>'
>>> contact().calibrate(model_with(floor, moving))
ArgumentError: geom 'floor' and geom 'ball': types = ['plane', 'sphere']: must be a fixed plane
    and a sphere
>>> contact().calibrate(model_with("<freejoint/>", ""))
ArgumentError: body of sphere 'ball' = 'fixed': must be able to move
>>> without = '<option><flag {}="disable"/></option><worldbody>'
>>> contact().calibrate(model_with("<worldbody>", without.format("contact")))
ArgumentError: flag contact = 'disable': must be 'enable', as the flag constraint
>>> contact().calibrate(model_with("<worldbody>", without.format("constraint")))
ArgumentError: flag contact = 'disable': must be 'enable', as the flag constraint

# Unequal moments of inertia
>>> rod = '<inertial pos="0 0 0" mass="0.1" diaginertia="1e-8 3e-5 3e-5"/>'
>>> model = model_with("<freejoint/>", f"<freejoint/>{rod}")
>>> model.opt.impratio = 1e-9
>>> contact().calibrate(model)
ArgumentError: option impratio = 1e-09: must be at most 1.1e-10, so that R >= 100 A

# Dry friction beside it
>>> scene = mm.Top(surface="plane", coulomb_friction=0.1)
>>> mm.simulate(scene, method="mujoco/rk4", timestep=0.025, duration=1)
ArgumentError: timestep = 0.025: must be less than 0.005 s with dry friction

# Magnets that collide
>>> model = two(0.021)
>>> model.geom_contype[:] = 0
>>> steps(model, 150)
UserWarning: within one timestep, magnetism moved body 'one' by about its size, or alone would
    turn it by more than 4 rad from rest, so that it may fly apart; mm.check(model) proposes a
    timestep and contacts for magnets that touch
>>> steps(magnets(LINKED), 1)
UserWarning: body 'one' has sunk into body 'two' by more than a quarter of its width, so that
    their dipoles are too near; mm.check(model) proposes a timestep and contacts for magnets that
    touch
>>> steps(two(0.0074), 1)
FatalError: bodies 1 'one' and 2 'two' are magnets or iron that overlap at the start, by more than
    a quarter of the width of the first; move them apart, or exclude their contact
>>> steps(two(0.0074, plugin=True), 1)
FatalError: bodies 1 'one' and 2 'two' are magnets or iron that overlap at the start, by more than
    a quarter of the width of the first; move them apart, or exclude their contact
>>> steps(two(0.0074, "box"), 1)
FatalError: bodies 1 'one' and 2 'two' are magnets or iron that overlap at the start, by more than
    a quarter of the width of the first; move them apart, or exclude their contact
"""
