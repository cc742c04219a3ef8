"""What is said while MuJoCo steps, by the callback `mm.magnetism` and by the plugin."""

import math

import mujoco
import mujoco.rollout
import numpy as np

import magmotor as mm
from magmotor.mjcf import layout

MODEL = """
<mujoco>
  <extension>{extension}</extension>
  <option gravity="0 0 0" timestep="0.00390625"/>
  {head}
  <custom>{text}{custom}</custom>
  <default><geom contype="0" conaffinity="0" size="0.1"/></default>
  <worldbody>{world}<body name="body" mocap="{mocap}">{body}</body></worldbody>
  {sensor}
</mujoco>"""
PLUGIN = '<plugin plugin="magmotor.forces"><instance name="magnets"/></plugin>'
FIXED = '<site name="fixed" pos="1 0 0" user="1"/>'
MAGNET = '<site name="magnet" user="1"/>'
LIFTED = '<joint/><geom size="0.01"/><site pos="0 0 1" user="1"/>'
MOVING = '<joint type="slide" axis="1 0 0"/><geom name="ball"/>'
NOISY = '<body name="noisy" user="1 0 0 0 0 0"><freejoint/><geom/></body>'
IRON = """<numeric name="soft" data="{}"/><tuple name="iron">
<element objtype="numeric" objname="soft"/>{}</tuple>"""
GEOM = '<element objtype="geom" objname="{}"/>'
PLATE = '<geom name="plate" type="plane" size="1 1 1"/>'
FIELD = '<numeric name="field" data="{}"/>'
COUPLING = """<tuple name="coupling{0}"><element objtype="body" objname="world" prm="{0}"/>
<element objtype="body" objname="body" prm="{0}"/></tuple>"""
SENSOR = """<sensor><plugin name="hall" plugin="magmotor.magnetometer" objtype="{}" objname="{}"/>
</sensor>"""
MANY = "".join(f'<geom name="g{k}" size="0.01" pos="{k} 9 0"/>' for k in range(300))


def model(
    *world, body=MOVING + MAGNET, act="all", name="magmotor", plugin=False, iron="", chi=1000,
    sensor="", **parts,
):  # fmt: skip
    """Return a model with these elements of the world, and a body with a magnet."""
    given = {"custom": "", "head": "", "mocap": "false"} | parts
    if iron:
        given["custom"] += IRON.format(chi, "".join(GEOM.format(each) for each in iron.split()))
    extension = PLUGIN * plugin + '<plugin plugin="magmotor.magnetometer"/>' * bool(sensor)
    text = f'<text name="{name}" data="{act}"/>' if act else ""
    sensor = SENSOR.format(*sensor.split()) if sensor else ""
    return mujoco.MjModel.from_xml_string(
        MODEL.format(
            extension=extension, text=text, world="".join(world), body=body, sensor=sensor, **given
        )
    )


def table(first=-1, last=1):
    """Return the numbers of a field on 4 x 4 x 4 nodes from `first` to `last` along each axis."""
    step = (last - first) / 3
    return FIELD.format(f"4 4 4 {3 * f'{first} '} {3 * f'{step} '}" + 64 * "0 0 1 ")


def step(model, data=None, **state):
    """Take a step from a state, inside of a block."""
    data = mujoco.MjData(model) if data is None else data
    for name, value in state.items():
        if np.ndim(getattr(data, name)):
            getattr(data, name)[: np.size(value)] = value
        else:
            setattr(data, name, value)
    with mm.magnetism():
        mujoco.mj_step(model, data)


def at(model, position):
    """Return data in which the body is at a position."""
    data = mujoco.MjData(model)
    data.qpos[0] = position
    mujoco.mj_forward(model, data)
    return data


def changed(model, field, element, value):
    """Return a model after a change of one of its numbers."""
    getattr(model, field)[element] = value
    return model


def roll_out(model, *positions):
    """Roll out on two threads from positions."""
    data = [mujoco.MjData(model) for _ in range(2)]
    states = np.array([(0.0, position, 0.0) for position in positions])
    mujoco.rollout.rollout(model, data, states, nstep=3)


TABLE = r"""
# Dipoles that coincide
>>> step(model(FIXED), qpos=1)
FatalError: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined
>>> step(model(FIXED, custom=COUPLING.format(2)), qpos=1)
FatalError: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined
>>> step(model(FIXED, plugin=True), qpos=1)
FatalError: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined
>>> pair = model(FIXED)
>>> mm.magnetic_energy(pair, at(pair, 1))
DeclarationError(coincidence, 1): dipole sites 1 'magnet' and 0 'fixed' coincide: their force is
    undefined
>>> mm.Langevin(pair).step(at(pair, 1))
FatalError: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined
>>> mm.field(pair, at(pair, 0), [1, 0, 0])
ArgumentError: points = array([1., 0., 0.]): must not coincide with a dipole (within 1e-09 m)

# Data without positions
>>> mm.magnetic_energy(pair, mujoco.MjData(pair))
NameError: name 'pair' is not defined
>>> mm.field(pair, mujoco.MjData(pair), [0, 0, 1])
NameError: name 'pair' is not defined

# Magnets by their geom that coincide
>>> ball = '<geom name="ball" size="0.1" user="0 0 1"/>'
>>> both = model(ball, body=MOVING.replace("/>", ' user="0 0 1"/>').replace("ball", "other"))
>>> mm.magnetic_energy(both, at(both, 0))
DeclarationError(potential, 0): joint 0 '': its user numbers must be pairs, the finite Fourier
    coefficients of a potential, and the joint must be a slide or a hinge
>>> site = model(ball, body=MOVING + MAGNET)
ValueError: XML Error: Error: repeated name 'ball' in geom
Element 'geom', line 8
>>> mm.magnetic_energy(site, at(site, 0))
NameError: name 'site' is not defined

# Dipoles and a table
>>> step(model(custom=table()), qpos=2)
FatalError: dipole site 0 'magnet' is outside the grid of the table in numeric 0 'field': it is at
    (2, 0, 0) m in the frame of the grid, which reaches from (-1, -1, -1) to (1, 1, 1) m and must
    contain all magnets and all iron
>>> tabulated = model(custom=table())
>>> mm.magnetic_energy(tabulated, at(tabulated, 2))
DeclarationError(outside, 0): dipole site 0 'magnet' is outside the grid of the table in numeric 0
    'field': it is at (2, 0, 0) m in the frame of the grid, which reaches from (-1, -1, -1) to (1,
    1, 1) m and must contain all magnets and all iron
>>> mm.field(tabulated, at(tabulated, 0), [0, 0, 9])
ArgumentError: points = array([0., 0., 9.]): must be inside the table of numeric 'field'
>>> step(changed(model(custom=table()), "numeric_data", slice(9, None), math.nan), qpos=0.2)
FatalError: dipole site 0 'magnet' is at a node that is not finite of the table in numeric 0
    'field': it is at (0.2, 0, 0) m in the frame of the grid, which reaches from (-1, -1, -1) to
    (1, 1, 1) m and must contain all magnets and all iron

# Iron
>>> low = '<body name="low" pos="9 0 -1"><geom name="low"/></body>'
>>> step(model(low, PLATE, iron="plate low", body=LIFTED))
FatalError: geom 1 'low' is below the plane of iron (on body 1 'low'), where mirror images do not
    give the field; mm.check(model) says what keeps it above
>>> step(model('<site pos="0 0 -1" user="1"/>', PLATE, iron="plate", body=LIFTED))
FatalError: dipole site 0 '' is below the plane of iron (on body 0 'world'), where mirror images
    do not give the field; mm.check(model) says what keeps it above

# Memory
>>> sites = "".join(f'<site pos="{k} 1 0" user="1"/>' for k in range(300))
>>> small = model(sites, head='<size memory="1K"/>')
>>> step(small)
FatalError: mj_stackAlloc: out of memory, stack overflow...(increase <size memory="..."/>)...
>>> mm.Langevin(small).step(mujoco.MjData(small))
FatalError: size memory of the model = 1024: must be larger by about ... bytes, for the dipoles
>>> pieces = " ".join(f"g{k}" for k in range(300))
>>> small = model(MANY, iron=pieces, head='<size memory="70K"/>')
>>> step(small)
FatalError: mj_stackAlloc: out of memory, stack overflow...(increase <size memory="..."/>)...
>>> mm.magnetic_energy(small, at(small, 0))
ArgumentError: size memory of the model = 71680: must be larger by about ... bytes, for the dipoles

# Noise
>>> noisy = model(NOISY, head='<size nuserdata="5"/>')
>>> step(noisy, userdata=-1)
FatalError: userdata[0] = -1: the numbers that select the noise (seed, replica, factor, level,
    first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at most 31,
    or 32 plus the window for a held path
>>> step(noisy, time=math.nan)
FatalError: time = nan: must be finite and between -2^53 and 2^53 timesteps while noise acts
>>> step(noisy, time=math.inf)
FatalError: time = inf: must be finite and between -2^53 and 2^53 timesteps while noise acts
>>> step(noisy, time=-1e300)
FatalError: time = -1e+300: must be finite and between -2^53 and 2^53 timesteps while noise acts
>>> step(noisy, time=2.0**53 * noisy.opt.timestep)
FatalError: time = 3.51844e+13: must be finite and between -2^53 and 2^53 timesteps while noise
    acts

# Numbers that change after the model is compiled
>>> step(changed(model(FIXED), "site_user", 1, math.nan))
FatalError: site 1 'magnet': its only user number must be its moment in A m^2, which must be
    finite; the direction is its z axis
>>> long = model(FIXED.replace("fixed", 600 * "e"))
>>> step(changed(long, "site_user", 0, math.nan))
FatalError: site 0 'eeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeeee...': its only
    user number must be its moment in A m^2, which must be finite; the direction is its z axis
>>> step(changed(model(FIXED.replace("fixed", 600 * "漢")), "site_user", 0, math.nan))
FatalError: site 0 '漢漢...漢...': its only user number must be its moment in A m^2, which must be
    finite; the direction is its z axis
>>> step(changed(model(FIXED.replace("fixed", "süß")), "site_user", 0, math.nan))
FatalError: site 0 'süß': its only user number must be its moment in A m^2, which must be finite;
    the direction is its z axis

# Indices that lead out of the model
>>> mm.describe(changed(model(FIXED), "site_bodyid", 1, -1))
DeclarationError(index, 1): site_bodyid[1] of the model = -1: must be at least 0 and less than 2
>>> mm.describe(changed(model(FIXED), "site_bodyid", 1, 3))
DeclarationError(index, 1): site_bodyid[1] of the model = 3: must be at least 0 and less than 2
>>> mm.describe(changed(model(FIXED), "body_weldid", 1, 2))
DeclarationError(index, 1): body_weldid[1] of the model = 2: must be at least 0 and less than 2
>>> mm.describe(changed(model(FIXED), "name_textadr", 0, -1))
DeclarationError(index, 0): name_textadr[0] of the model = -1: must be at least 0 and less than 52
>>> mm.describe(changed(model(FIXED), "text_adr", 0, 2**31 - 1))
DeclarationError(index, 0): text_adr[0] of the model = 2147483647: must be at least 0 and less
    than 4
>>> mm.describe(changed(model(FIXED), "geom_bodyid", 0, -1))
DeclarationError(index, 0): geom_bodyid[0] of the model = -1: must be at least 0 and less than 2
>>> mm.describe(changed(model(FIXED), "name_bodyadr", 1, -1))
DeclarationError(index, 1): name_bodyadr[1] of the model = -1: must be at least 0 and less than 52
>>> two = COUPLING.format(2) + COUPLING.format(3)
>>> mm.describe(changed(model(custom=two), "tuple_objid", 0, 99))
DeclarationError(index, 0): tuple_objid[0] of the model = 99: must be at least 0 and less than 2
>>> hull = '<geom type="mesh" mesh="hull" user="0 0 1"/>'
>>> asset = '<asset><mesh name="hull" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>'
>>> mm.describe(changed(model(hull, head=asset), "geom_dataid", 0, 1))
DeclarationError(index, 0): geom_dataid[0] of the model = 1: must be at least 0 and less than 1
>>> mm.describe(changed(model(hull, head=asset), "mesh_face", (1, 2), 4))
DeclarationError(index, 5): mesh_face[5] of the model = 4: must be at least 0 and less than 4
>>> mm.describe(changed(model(custom=two), "tuple_adr", 1, 0))
DeclarationError(index, 1): tuple_adr[1] of the model = 0 and tuple_size[1] = 2: must be a range
    within 4 elements behind those before
>>> step(changed(model(FIXED), "site_bodyid", 1, -1))
FatalError: site_bodyid[1] of the model = -1: must be at least 0 and less than 2
>>> step(changed(model(FIXED, plugin=True), "site_bodyid", 1, -1))
FatalError: site_bodyid[1] of the model = -1: must be at least 0 and less than 2

# Magnetometers
>>> probe = '<site name="probe" pos="9 9 9"/>'
>>> model(probe, sensor="geom ball")
ValueError: Error: engine error: magnetometer 0 'hall': its objtype must be 'site'
>>> model(probe, sensor="site magnet")
ValueError: Error: engine error: magnetometer 0 'hall': its site 1 'magnet' coincides with a
    dipole, is outside the table of a field, or is below the plane of iron
>>> model(probe, sensor="site probe", custom=table())
ValueError: Error: engine error: magnetometer 0 'hall': its site 0 'probe' coincides with a
    dipole, is outside the table of a field, or is below the plane of iron
>>> hall = model(probe, sensor="site probe")
>>> step(changed(hall, "sensor_objtype", 0, mujoco.mjtObj.mjOBJ_BODY))
FatalError: magnetometer 0 'hall': its objtype must be 'site'
>>> hall = model(probe, sensor="site probe")
>>> step(changed(hall, "site_user", 0, 1))
FatalError: magnetometer 0 'hall': its site 0 'probe' coincides with a dipole, is outside the
    table of a field, or is below the plane of iron
>>> step(changed(hall, "sensor_adr", 0, 1))
FatalError: sensor_adr[0] of the model = 1 and sensor_dim[0] = 3: must be a range within 3
    elements
>>> step(changed(hall, "sensor_adr", 0, -1))
FatalError: sensor_adr[0] of the model = -1 and sensor_dim[0] = 3: must be a range within 3
    elements
>>> step(changed(hall, "sensor_adr", 0, 10**8))
FatalError: sensor_adr[0] of the model = 100000000 and sensor_dim[0] = 3: must be a range within 3
    elements
>>> hall = model(probe, sensor="site probe")
>>> step(changed(hall, "sensor_objid", 0, 2))
FatalError: sensor_objid[0] of the model = 2: must be at least 0 and less than 2
>>> step(changed(hall, "sensor_objid", 0, -1))
FatalError: sensor_objid[0] of the model = -1: must be at least 0 and less than 2
>>> step(changed(hall, "sensor_objid", 0, 10**8))
FatalError: sensor_objid[0] of the model = 100000000: must be at least 0 and less than 2

# Nothing acts
>>> step(mujoco.MjModel.from_xml_string("<mujoco/>"))
UserWarning: nothing acts on this model: neither a mark nor a site with a user number names
    dipoles
>>> step(model(body=MOVING))
UserWarning: nothing acts on this model: it has no dipole sites (a site with user="MOMENT" in A
    m^2, along its z axis); Brownian wrenches and potentials need a mark and user numbers of
    bodies or joints
>>> step(model(body=MOVING, act="fields", custom=FIELD.format("0 0 1")))
UserWarning: nothing acts on this model: it has no dipole sites (a site with user="MOMENT" in A
    m^2, along its z axis); Brownian wrenches and potentials need a mark and user numbers of
    bodies or joints
>>> step(model(act="couplings"))
UserWarning: nothing acts on this model: it declares dipoles, but no mark names them
>>> step(model(act="couplings", plugin=True))
UserWarning: nothing acts on this model: it declares dipoles, but no mark names them
UserWarning: nothing acts on this model: it declares dipoles, but no mark names them
>>> step(model(act="fields", custom=FIELD.format("0 0 1")))
UserWarning: nothing acts on this model: it declares dipoles, but no mark names them
>>> step(model(act="dipoles", body=MOVING, custom=FIELD.format("0 0 1")))
UserWarning: nothing acts on this model: it has no dipole sites (a site with user="MOMENT" in A
    m^2, along its z axis); Brownian wrenches and potentials need a mark and user numbers of
    bodies or joints
>>> step(model())
UserWarning: nothing acts on this model: its dipole sites, iron and fields are all on one rigid
    body, so that none acts on another
>>> step(model(FIXED, body='<geom name="ball"/>' + MAGNET, mocap="true"))
UserWarning: nothing acts on this model: none of the bodies with dipole sites can move (they have
    no joints)
>>> step(model(FIXED, custom=COUPLING.format(0)))
UserWarning: nothing acts on this model: its couplings turn all magnetism off (prm is 0, the
    default)
>>> step(model('<geom name="core" pos="2 0 0"/>', iron="core", chi=0))
UserWarning: nothing acts on this model: the susceptibility of its iron is 0
>>> numbered = "".join(f'<site pos="0 {k} 0" user="{k}"/>' for k in (4, 5, 6))
>>> step(model(numbered, body=MOVING, act=None))
UserWarning: nothing acts on this model: its user numbers may have another meaning; to say which
    of them act, add <custom><text name="magmotor" data="dipoles couplings noise
    potentials"/></custom>

# Texts that are nearly a mark
>>> step(model(FIXED, name="magmotr"))
UserWarning: text 'magmotr' does not say what acts, since only the name magmotor makes it a mark
    (MjSpec.attach adds prefixes to names)
>>> model(FIXED, name="Magmotor", plugin=True)
UserWarning: text 'Magmotor' does not say what acts, since only the name magmotor makes it a mark
    (MjSpec.attach adds prefixes to names)
>>> step(model(FIXED, name="mag_motor", act="dipoles fields"))
UserWarning: text 'mag_motor' does not say what acts, since only the name magmotor makes it a mark
    (MjSpec.attach adds prefixes to names)
>>> step(model(FIXED, name="g_magmotor"))
UserWarning: text 'g_magmotor' does not say what acts, since only the name magmotor makes it a
    mark (MjSpec.attach adds prefixes to names)

# What the plugin says when a model is compiled
>>> flags = '<option><flag spring="disable" damper="disable"/></option>'
>>> deaf = model(FIXED, head=flags, plugin=True)
UserWarning: MuJoCo skips the plugin magmotor.forces, since the flags spring and damper are both
    disabled; enable one of them
>>> data = mujoco.MjData(deaf)
UserWarning: MuJoCo skips the plugin magmotor.forces, since the flags spring and damper are both
    disabled; enable one of them
>>> asleep = '<option><flag sleep="enable"/></option>'
>>> tired = model(FIXED, head=asleep, plugin=True)
>>> data = mujoco.MjData(tired)
UserWarning: a sleeping body is not woken by forces of the plugin magmotor.forces
>>> silent = model(FIXED, act="couplings", plugin=True)
UserWarning: nothing acts on this model: it declares dipoles, but no mark names them

# Callbacks and forces of the user
>>> with mm.magnetism():
...     mujoco.set_mjcb_control(lambda *_: None)
UserWarning: mujoco.set_mjcb_control replaced the callback of magnetism() inside the block, and
    since then nothing of magmotor has acted: set yours before the block, which calls it
>>> mujoco.set_mjcb_control(None)
>>> with mm.magnetism():
...     mujoco.set_mjcb_control(None)
UserWarning: mujoco.set_mjcb_control replaced the callback of magnetism() inside the block, and
    since then nothing of magmotor has acted: set yours before the block, which calls it
>>> pair = model(FIXED)
>>> data = at(pair, 0)
>>> data.xfrc_applied[1, 0] = 1
>>> step(pair, data)
UserWarning: magnetism() has overwritten the force that was set in xfrc_applied of body 'body': it
    sets this row at the start of each step, so that a force has an effect only if it is set
    between mj_step1 and mj_step2, and added to what is there; set qfrc_applied
    (mm.apply_perturbation does, for the viewer's mouse), or let the plugin magmotor.forces act,
    which leaves xfrc_applied to you

# Structs of another MuJoCo
>>> layout.verify(layout.current()._replace(nq=24))
LayoutError: MuJoCo ... does not keep nq... at the declared offsets: this version is not
    supported; 3.11 to 4.0 are: pip install "mujoco==4.0.*"
>>> layout.verify(layout.current()._replace(nq=24, nv=0, numeric_data=8))
LayoutError: MuJoCo ... does not keep nq, nv, ...numeric_data at the declared offsets: ...

# Rollouts on threads
>>> with mm.magnetism():
...     roll_out(model(FIXED), 0, 1)
FatalError: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined; the states
    of these runs are NaN
>>> with mm.magnetism():
...     roll_out(model(FIXED), 0, 1)
...     raise KeyError("mine")
UserWarning: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined; the states
    of these runs are NaN
KeyError: 'mine'
>>> with mm.magnetism():
...     roll_out(model(FIXED), 0, 1)
...     roll_out(model(FIXED.replace("fixed", "other")), 0, 1)
FatalError: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined (and 1 other
    error); the states of these runs are NaN
>>> with mm.magnetism():
...     with mm.magnetism():
...         roll_out(model(FIXED), 0, 1)
UserWarning: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined; the states
    of these runs are NaN
FatalError: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined; the states
    of these runs are NaN
>>> roll_out(model(FIXED, plugin=True), 0, 1)
UserWarning: dipole sites 1 'magnet' and 0 'fixed' coincide: their force is undefined; the state
    is set to NaN
>>> moving = model(FIXED)
>>> data = mujoco.MjData(moving)
>>> mm.Langevin(moving).rollout([data, data], np.zeros((2, 3)), None, control_spec=0, nstep=1)
ArgumentError: data = [<...>, <...>]: must not contain one mjData twice: each is for one thread
"""
