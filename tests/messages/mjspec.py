"""Magnets, coils, fields and iron that are added to a model by `MjSpec`."""

import math

import mujoco

import magmotor as mm

MODEL = """
<mujoco>
  <worldbody>
    <site name="mount"/>
    <geom name="table" type="plane" size="1 1 1" pos="0 0 -0.2"/>
    <body name="hand" pos="0 0 0.1"><freejoint/><geom size="0.01"/></body>
    <body name="disk" pos="0.1 0 0"><freejoint/><geom name="core" size="0.001"/></body>
    <body name="pellet" pos="0 -0.1 0"><freejoint/><geom name="pellet" size="0.005"/></body>
  </worldbody>
  <actuator><general name="current" site="mount" gainprm="0"/></actuator>
</mujoco>"""
GAUGE = mm.magnet("cylinder", (0.01, 0.004), grade="N42")


def composed():
    """Return a spec with one of each."""
    spec = mujoco.MjSpec.from_string(MODEL)
    tip = mm.add_dipole(spec, spec.body("hand"), 2, name="tip")
    mm.add_magnet(spec, spec.body("disk"), GAUGE, error=0.05, gap=0.02, name="disk")
    mm.add_coil(spec, spec.actuator("current"), [tip], name="coil of the hand")
    mm.add_field(spec, [0, 0, 0.01])
    mm.add_iron(spec, [spec.geom("pellet")], 1000)
    return spec


def attached(name, own=None):
    """Return a spec with a numeric, to which one with another value is attached."""
    spec, parent = composed(), mujoco.MjSpec()
    spec.add_numeric(name=name, data=[1e-3], size=1)
    if own is not None:
        parent.add_numeric(name=name, data=[own], size=1)
    parent.attach(spec, prefix="a/", frame=parent.worldbody.add_frame())
    return parent


TABLE = r"""
# Dipoles
>>> spec, other = composed(), composed()
>>> hand = spec.body("hand")
>>> mm.add_dipole(spec, "hand", 1)
ArgumentError: body = 'hand': must be an instance of mujoco.MjsBody or mujoco.MjsFrame
>>> mm.add_dipole(spec, other.body("hand"), 1)
ArgumentError: body = 'hand': must be in the spec, not in another one
>>> mm.add_dipole(spec, hand, math.nan)
ArgumentError: moment = nan: must be a finite number
>>> mm.add_dipole(spec, hand, [0, 0, 1])
ArgumentError: moment = [0, 0, 1]: must be a number
>>> mm.add_dipole(spec, hand, 1, pos=[0, 0])
InputError: pos has shape (2,): must have shape (3,)
>>> mm.add_dipole(spec, hand, 1, zaxis=[0, 0, 0])
ArgumentError: zaxis = array([0., 0., 0.]): must not be zero
>>> mm.add_dipole(spec, hand, 1, name="tip")
ArgumentError: name = 'tip': must be new, since the spec has a site of this name

# Magnets
>>> spec, other = composed(), composed()
>>> hand = spec.body("hand")
>>> mm.add_magnet(spec, hand, "disk", error=0.05, gap=0.02)
ArgumentError: magnet = 'disk': must be an instance of magmotor.Magnet
>>> mm.add_magnet(spec, hand, GAUGE, error=2, gap=0.02)
ArgumentError: error = 2: must be less than 1
>>> mm.add_magnet(spec, hand, GAUGE, error=0.05, gap=0.02, name="core")
ArgumentError: name = 'core': must be new, since the spec has a geom of this name
>>> mm.add_magnet(spec, hand, GAUGE, error=0.05, gap=0.02, name="disk")
ArgumentError: name = 'disk': must be new, since the spec has a geom of this name
>>> mm.add_magnet(spec, other.body("hand"), GAUGE, error=0.05, gap=0.02)
ArgumentError: body = 'hand': must be in the spec, not in another one

# Coils
>>> spec, other = composed(), composed()
>>> current, tip = spec.actuator("current"), spec.site("tip")
>>> mm.add_coil(spec, current, [])
ArgumentError: dipoles = []: must be at least one geom, site or body
>>> mm.add_coil(spec, current, ["tip"])
ArgumentError: dipoles[0] = 'tip': must be an instance of mujoco.MjsBody, mujoco.MjsSite or
    mujoco.MjsGeom
>>> mm.add_coil(spec, current, [other.site("mount")])
ArgumentError: dipoles[0] = 'mount': must be in the spec, not in another one
>>> mm.add_coil(spec, other.actuator("current"), [tip])
ArgumentError: actuator = 'current': must be in the spec, not in another one
>>> mm.add_coil(spec, current, [tip], saturation=-1)
ArgumentError: saturation = -1: must be at least 0
>>> mm.add_coil(spec, current, [tip], name="hand")
ArgumentError: name = 'hand': must start with 'coil'
>>> mm.add_coil(spec, current, [tip], name="coil of the hand")
ArgumentError: name = 'coil of the hand': must be new, since the spec has a tuple of this name
>>> nameless = mm.add_dipole(spec, spec.body("hand"), 2)
>>> mm.add_coil(spec, current, [nameless], name="coil 2")
ArgumentError: name of dipoles[0] = '': must be one word, since a tuple lists names with spaces
    between them
>>> left_tip = mm.add_dipole(spec, spec.body("hand"), 2, name="left tip")
>>> mm.add_coil(spec, current, [left_tip], name="coil 2")
ArgumentError: name of dipoles[0] = 'left tip': must be one word, since a tuple lists names with
    spaces between them

# Fields
>>> spec, other = composed(), composed()
>>> mm.add_field(spec, [0, 0])
ArgumentError: field = [0.0, 0.0]: must be B in T (3 finite numbers), B and G_xx G_xy G_xz G_yy
    G_yz in T/m (8), or a table: numbers of nodes n_x n_y n_z, each at least 4, the first node x y
    z, positive spacings, and 3 n_x n_y n_z flux densities
>>> mm.add_field(spec, [0, 0, math.inf])
InputError: field contains inf: every value must be finite and at most 1e+30 in magnitude
>>> mm.add_field(spec, [3, 4, 4, 0, 0, 0, 1, 1, 1, *[0] * 144])
ArgumentError: field = [3.0, 4.0, 4.0, 0.0, 0.0, ...: must be B in T (3 finite numbers), ...
>>> mm.add_field(spec, "0 0 1")
ArgumentError: field = '0 0 1': must be numbers, or MJCF as tabulated_field returns it
>>> mm.add_field(spec, [0, 0, 1], frame=other.body("hand"), name="field_2")
ArgumentError: frame = 'hand': must be in the spec, not in another one
>>> mm.add_field(spec, [0, 0, 1], saturation=1, name="field_2")
ArgumentError: saturation = 1.0: must be 0 without an actuator
>>> mm.add_field(spec, [0, 0, 1], name="hand")
ArgumentError: name = 'hand': must start with 'field'
>>> mm.add_field(spec, [0, 0, 1], name="field 2")
ArgumentError: name = 'field 2': must start with 'field' and be one word
>>> mm.add_field(spec, [0, 0, 1], name="field")
ArgumentError: name = 'field': must be new, since the spec has a numeric of this name

# Iron
>>> spec, other = composed(), composed()
>>> core = spec.geom("core")
>>> mm.add_iron(spec, [], 1000)
ArgumentError: geoms = []: must be a sequence of at least one MjsGeom
>>> mm.add_iron(spec, [other.geom("core")], 1000)
ArgumentError: geoms[0] = 'core': must be in the spec, not in another one
>>> mm.add_iron(spec, [core], -2)
ArgumentError: susceptibility = -2: must be at least -1
>>> mm.add_iron(spec, [core], 1000, saturation=-1)
ArgumentError: saturation = -1: must be at least 0
>>> mm.add_iron(spec, [core], 1000, name="iron")
ArgumentError: name = 'iron': must be new, since the spec has a numeric of this name
>>> mm.add_iron(spec, [spec.geom("pellet")], 1000, name="iron_2")
>>> mm.add_magnetism(spec)
>>> spec.compile()
ValueError: Error: engine error: iron tuple 2 'iron_2': element 1, geom 'pellet', is also named by
    iron tuple 1

# Magnetism of specs that are attached
>>> mm.add_magnetism(attached("magnetic_constant"))
ArgumentError: numeric 'a/magnetic_constant' = [0.001]: must be as in the spec to which it is
    attached, where it is missing
>>> mm.add_magnetism(attached("magnetic_constant", 2e-3))
ArgumentError: numeric 'a/magnetic_constant' = [0.001]: must be as in the spec to which it is
    attached, where it is [0.002]
>>> mm.add_magnetism(attached("magnetic_tolerance"))
ArgumentError: numeric 'a/magnetic_tolerance' = [0.001]: must be as in the spec to which it is
    attached, where it is missing
>>> mm.add_magnetism(attached("magnetic_tolerance", 2e-3))
ArgumentError: numeric 'a/magnetic_tolerance' = [0.001]: must be as in the spec to which it is
    attached, where it is [0.002]
>>> mm.add_magnetism(attached("magnetic_tolerance", 1e-3))
>>> spec = mujoco.MjSpec()
>>> cable = "mujoco.elasticity.cable"
>>> plugin = spec.add_plugin(name="magnets", plugin_name=cable, active=True)
>>> mm.add_magnetism(spec)
ArgumentError: plugin 'magnets' = 'mujoco.elasticity.cable': must be that of magmotor.forces,
    which needs this name for its instance
"""
