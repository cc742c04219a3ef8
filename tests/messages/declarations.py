"""What a model declares: marks, moments, couplings, coils, fields, iron, noise and constants."""

import math

import mujoco

import magmotor as mm

MODEL = """
<mujoco>
  <extension>{extension}</extension>
  <custom>{text}{custom}</custom>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 -1"/>
    <geom name="table" type="plane" size="1 1 1" pos="0 0 -2"/>
    <geom name="bar" type="cylinder" size="0.1 0.1" pos="0 2 0"/>
    <site name="fixed" pos="0 0 1" user="2"/>
    <body name="needle" user="{wrenches}">
      <joint name="turn" user="{potential}"/>
      <geom name="core" size="0.1"/>
      <site name="hand" pos="0 0 0.05" user="{moment}"/>
    </body>
    <body name="ball" pos="1 0 0"><joint name="flight" type="free" user="{of_flight}"/>
      <geom name="ball" size="0.1" user="{of_geom}"/>
      <site name="ball" user="1"/></body>
    <body name="base" pos="3 0 0"><site name="base" user="1"/></body>
  </worldbody>
  {actuator}
</mujoco>"""
ACTUATORS = """<actuator><general name="current" site="hand" gainprm="0"/>
<general name="late" site="hand" gainprm="0" delay="0.01" nsample="20"/></actuator>"""
PLUGIN = """<plugin plugin="magmotor.forces"><instance name="magnets">{}</instance></plugin>"""
CONFIG = '<config key="{}" value="{}"/>'


def model(*custom, act="all", plugin=False, config="", key="act", **numbers):
    """Return a model with these elements of <custom>, in which some user numbers are changed."""
    config = CONFIG.format(key, config) if config else ""
    given = {
        "moment": "1",
        "wrenches": "",
        "potential": "",
        "of_flight": "",
        "of_geom": "",
    } | numbers
    return mujoco.MjModel.from_xml_string(
        MODEL.format(
            extension=PLUGIN.format(config) if plugin or config else "",
            text=f'<text name="magmotor" data="{act}"/>' if act is not None else "",
            custom="".join(custom),
            actuator=ACTUATORS if "actuator" in str(custom) else "",
            **given,
        )
    )


def numeric(name, data):
    """Return a numeric as MJCF."""
    return f'<numeric name="{name}" data="{data}"/>'


def group(name, *elements):
    """Return a tuple as MJCF; of each element its type, its name and its prm, if any."""
    split = [f"{each} 0".split()[:3] for each in elements]
    each = '<element objtype="{}" objname="{}" prm="{}"/>'
    return f'<tuple name="{name}">{"".join(each.format(*parts) for parts in split)}</tuple>'


def coupling(*elements, name="coupling#"):
    """Return a tuple as MJCF that follows one that couples the world and the ball."""
    good = group("coupling", "body world 2", "body ball 2")
    return good + group(name, *elements)


def field(data, *elements):
    """Return a field as MJCF, and a tuple that names it and these elements."""
    return numeric("field", data) + group("field too", "numeric field", *elements)


def conductor(*elements, material="3.5e7 0.003"):
    """Return a conductor as MJCF: a tuple of these elements, and the numeric."""
    return numeric("material", material) + group("conductor", *elements)


def hysteresis(*elements, loop="12 0.2"):
    """Return hysteresis as MJCF: a tuple of these elements, and the numeric."""
    return numeric("loop", loop) + group("hysteresis", *elements)


def iron(*elements, material="1000"):
    """Return iron as MJCF: a tuple of a material and these elements."""
    return numeric("material", material) + group("iron", "numeric material", *elements)


def sized(geom, *size):
    """Return a model with a piece of iron whose size is changed."""
    changed = model(iron(f"geom {geom}"))
    changed.geom(geom).size[: len(size)] = size
    return changed


def magnetized(geom, *polarization, size=()):
    """Return a model with numbers of geoms, of which one gets a polarization, or a size, too."""
    found = model(of_geom="0 0 1")
    found.geom(geom).user[:] = polarization
    found.geom(geom).size[: len(size)] = size
    return found


TETRAHEDRON = "0 0 0 1 0 0 0 1 0 0 0 1"


def hull(**attributes):
    """Return a magnet that is a mesh, as MJCF between elements of <custom>."""
    mesh = " ".join(f'{name}="{value}"' for name, value in attributes.items())
    geom = '<geom name="hull" type="mesh" mesh="hull" user="0 0 1"/>'
    assets = f'<asset><mesh name="hull" {mesh}/></asset>'
    return f"</custom>{assets}<worldbody>{geom}</worldbody><custom>"


def changed(name, *numbers):
    """Return a model with a numeric that is changed after the model is compiled."""
    found = model(numeric(name, "1 " * len(numbers) if len(numbers) > 1 else 0.01))
    found.numeric(name).data[:] = numbers
    return found


GRID = "0 0 0 1 1 1"

TABLE = r"""
# Magnets by their geom
>>> mm.describe(model(of_geom="0 0 2.6"))
DeclarationError(polarization, 4): geom 4 'ball': its user numbers 0 0 2.6 are a polarization in
    T, at most 2.5 T (iron has 2.2 T)
>>> mm.describe(model(of_geom="1.5 1.5 -1.5"))
DeclarationError(polarization, 4): geom 4 'ball': its user numbers 1.5 1.5 -1.5 are a polarization
    in T, at most 2.5 T (iron has 2.2 T)
>>> mm.describe(magnetized("core", 0, math.nan, 1))
DeclarationError(polarization, 3): geom 3 'core': its user numbers 0 nan 1 are a polarization, and
    must be finite
>>> mm.describe(model(of_geom="inf 0 0"))
DeclarationError(polarization, 4): geom 4 'ball': its user numbers inf 0 0 are a polarization, and
    must be finite
>>> mm.describe(magnetized("floor", 0, 0, 1))
DeclarationError(shapeless, 0): geom 0 'floor' has a polarization (its user numbers): it must be a
    sphere, an ellipsoid, a capsule, a cylinder, a box or a convex mesh
>>> mm.describe(magnetized("core", 0, 0, 1, size=[0]))
DeclarationError(size, 3): geom 3 'core': the size of iron and of magnets must be positive and
    finite
>>> mm.describe(magnetized("bar", 0, 0, 1, size=[1, math.nan]))
DeclarationError(size, 2): geom 2 'bar': the size of iron and of magnets must be positive and
    finite
>>> with_dent = TETRAHEDRON + " .2 .2 .2"
>>> mm.describe(model(hull(vertex=with_dent, face="0 2 1 0 1 3 0 3 2 1 2 4 2 3 4 3 1 4")))
DeclarationError(polyhedron, 0): geom 0 'hull' is a magnet, by its user numbers: its mesh must be
    convex: decompose it into convex ones, a geom each
>>> mm.describe(model(hull(vertex=TETRAHEDRON, face="0 2 1 0 1 3 0 3 2", inertia="shell")))
DeclarationError(polyhedron, 0): geom 0 'hull' is a magnet, by its user numbers: its mesh must be
    closed, and enclose a volume
>>> mm.describe(model(hull(builtin="sphere", params="4")))
DeclarationError(polyhedron, 0): geom 0 'hull' is a magnet, by its user numbers: its mesh must
    have at most 1000 faces: simplify it
>>> mm.describe(model(iron("geom ball"), of_geom="0 0 1"))
DeclarationError(magnetic_iron, 4): geom 4 'ball' is a magnet, by its user numbers, and iron: it
    must be one of them
>>> mm.describe(model(coupling("body needle 1", "body ball 1"), of_geom="0 0 1"))
DeclarationError(coupled_magnet, 4): geom 4 'ball' is a magnet of a body of coupling tuple 0
    'coupling': couplings do not apply to geoms, but to dipole sites

# Conductors
>>> mm.describe(model(conductor("numeric material")))
DeclarationError(conductor, 0): conductor tuple 0 'conductor' must name a numeric, its
    conductivity, and a geom
>>> mm.describe(model(conductor("geom floor", "geom core", "numeric material")))
DeclarationError(conductor, 0): conductor tuple 0 'conductor': element 1, geom 'core', must be a
    plane: the upper face of a plate without edges
>>> mm.describe(model(conductor("geom floor", "numeric material", "numeric material")))
DeclarationError(conductor, 0): conductor tuple 0 'conductor': element 2, numeric 'material', is
    one too many: one numeric in the tuple
>>> mm.describe(model(conductor("geom floor", "numeric material", "body world")))
DeclarationError(conductor, 0): conductor tuple 0 'conductor': element 2, body 'world', must be a
    numeric or a geom
>>> mm.describe(model(conductor("geom floor", "numeric material", "geom floor")))
DeclarationError(conductor, 0): conductor tuple 0 'conductor': element 2, geom 'floor', is also
    named by conductor tuple 0
>>> mm.describe(model(conductor("geom floor", "numeric material", material="-1")))
DeclarationError(conductivity, 0): numeric 0 'material' = -1: a conductor must have a conductivity
    in S/m and optionally a thickness in m, 0 for a half-space; not negative and finite
>>> mm.describe(model(conductor("geom floor", "numeric material", material="1 2 3")))
DeclarationError(conductivity, 0): numeric 0 'material' = 1 2 3: a conductor must have a
    conductivity in S/m and optionally a thickness in m, 0 for a half-space; not negative and
    finite

# Hysteresis
>>> mm.describe(model(hysteresis("numeric loop")))
DeclarationError(hysteresis, 0): hysteresis tuple 0 'hysteresis' must name a numeric, its loop,
    and a site
>>> mm.describe(model(hysteresis("site hand", "geom core", "numeric loop")))
DeclarationError(hysteresis, 0): hysteresis tuple 0 'hysteresis': element 1, geom 'core', must be
    a numeric or a site
>>> mm.describe(model(hysteresis("site hand", "numeric loop", "numeric loop")))
DeclarationError(hysteresis, 0): hysteresis tuple 0 'hysteresis': element 2, numeric 'loop', is
    one too many: one numeric in the tuple
>>> mm.describe(model(hysteresis("site hand", "numeric loop", "site hand")))
DeclarationError(hysteresis, 0): hysteresis tuple 0 'hysteresis': element 2, site 'hand', is also
    named by hysteresis tuple 0
>>> coil = group("coil", "actuator current", "site hand")
>>> mm.describe(model(hysteresis("site hand", "numeric loop") + coil))
DeclarationError(hysteresis, 0): hysteresis tuple 0 'hysteresis': element 0, site 'hand', is also
    driven by coil tuple 1
>>> mm.describe(model(hysteresis("site hand", "numeric loop", loop="12")))
DeclarationError(loop, 0): numeric 0 'loop' = 12: a loop must have a coercivity in A/m, which is
    positive and finite, and the remanence over the saturation, between 0 and 1
>>> mm.describe(model(hysteresis("site hand", "numeric loop", loop="12 1")))
DeclarationError(loop, 0): numeric 0 'loop' = 12 1: a loop must have a coercivity in A/m, which is
    positive and finite, and the remanence over the saturation, between 0 and 1
>>> negative = model(hysteresis("site hand", "numeric loop"))
>>> negative.site("hand").user[0] = -1e-3
>>> mm.describe(negative)
DeclarationError(moment, 1): site 1 'hand' = -0.001: the moment of a site with hysteresis is that
    at saturation, in A m^2, and must not be negative; its z axis may point the other way

# Marks
>>> mm.describe(model(act="magnet"))
DeclarationError(mark, 0): text 'magmotor' = 'magnet': must be one or more of the words dipoles,
    couplings, noise, potentials, fields, coils, iron, magnets, conductors, hysteresis, all,
    separated by spaces
>>> mm.describe(model(act="dipoles, noise"))
DeclarationError(mark, 0): text 'magmotor' = 'dipoles, noise': must be one or more of the words
    dipoles, couplings, noise, potentials, fields, coils, iron, magnets, conductors, hysteresis,
    all, separated by spaces
>>> mm.describe(model(act="dipolesnoise"))
DeclarationError(mark, 0): text 'magmotor' = 'dipolesnoise': must be one or more of the words
    dipoles, couplings, noise, potentials, fields, coils, iron, magnets, conductors, hysteresis,
    all, separated by spaces
>>> mm.describe(model(act="Dipoles"))
DeclarationError(mark, 0): text 'magmotor' = 'Dipoles': must be one or more of the words dipoles,
    couplings, noise, potentials, fields, coils, iron, magnets, conductors, hysteresis, all,
    separated by spaces
>>> mm.describe(model(act="%n"))
DeclarationError(mark, 0): text 'magmotor' = '%n': must be one or more of the words dipoles,
    couplings, noise, potentials, fields, coils, iron, magnets, conductors, hysteresis, all,
    separated by spaces
>>> mm.describe(model(act=" "))
DeclarationError(mark, 0): text 'magmotor' = ' ': must be one or more of the words dipoles,
    couplings, noise, potentials, fields, coils, iron, magnets, conductors, hysteresis, all,
    separated by spaces
>>> mm.describe(model(act="couplings dipolez"))
DeclarationError(mark, 0): text 'magmotor' = 'couplings dipolez': must be one or more of the words
    dipoles, couplings, noise, potentials, fields, coils, iron, magnets, conductors, hysteresis,
    all, separated by spaces

# Marks of the plugin
>>> model(plugin=True, act="dipols")
ValueError: Error: engine error: text 'magmotor' = 'dipols': must be one or more of the words
    dipoles, couplings, noise, potentials, fields, coils, iron, magnets, conductors, hysteresis,
    all, separated by spaces
>>> model(plugin=True, act=" ")
ValueError: Error: engine error: text 'magmotor' = ' ': must be one or more of the words dipoles,
    couplings, noise, potentials, fields, coils, iron, magnets, conductors, hysteresis, all,
    separated by spaces
>>> model(act=None, config="all, dipoles")
ValueError: Error: engine error: config 'act' of magmotor.forces = 'all, dipoles': must be one or
    more of the words dipoles, couplings, noise, potentials, fields, coils, iron, magnets,
    conductors, hysteresis, all, separated by spaces
>>> model(act=None, config="dipols")
ValueError: Error: engine error: config 'act' of magmotor.forces = 'dipols': must be one or more
    of the words dipoles, couplings, noise, potentials, fields, coils, iron, magnets, conductors,
    hysteresis, all, separated by spaces
>>> model(act="noise dipoles", config="all")
ValueError: Error: engine error: text 'magmotor' = 'noise dipoles' and config 'act' of
    magmotor.forces = 'all': must have the same words, or only one of the two must be given
>>> model(act="all", config="dipoles")
ValueError: Error: engine error: text 'magmotor' = 'all' and config 'act' of magmotor.forces =
    'dipoles': must have the same words, or only one of the two must be given
>>> model(key="kinds", config="all")
ValueError: Error: unrecognized attribute 'plugin:kinds' for plugin magmotor.forces'
Element name 'magnets', id 0, line 3
>>> model(act="")
ValueError: XML Error: text field cannot be empty
Element 'text', line 4

# Moments
>>> mm.describe(model(moment="0 5 0"))
DeclarationError(moment, 1): site 1 'hand': its only user number must be its moment in A m^2,
    which must be finite; the direction is its z axis
>>> mm.describe(model(moment="1 5"))
DeclarationError(moment, 1): site 1 'hand': its only user number must be its moment in A m^2, ...
>>> mm.describe(model(moment="0 0 0 1"))
DeclarationError(moment, 1): site 1 'hand': its only user number must be its moment in A m^2, ...
>>> mm.describe(model(moment="inf"))
DeclarationError(moment, 1): site 1 'hand': its only user number must be its moment in A m^2, ...
>>> mm.describe(model(moment="nan"))
DeclarationError(moment, 1): site 1 'hand': its only user number must be its moment in A m^2, ...
>>> mm.describe(model(moment="0 nan"))
DeclarationError(moment, 1): site 1 'hand': its only user number must be its moment in A m^2, ...
>>> model(moment="4 1", plugin=True)
ValueError: Error: engine error: site 1 'hand': its only user number must be its moment in A m^2,
    which must be finite; the direction is its z axis
>>> model(moment="inf", plugin=True)
ValueError: Error: engine error: site 1 'hand': its only user number must be its moment in A ...

# Noise and potentials
>>> mm.describe(model(wrenches="1 1 1 1 1 1 1 1 1"))
DeclarationError(wrench, 1): body 1 'needle': its user numbers must be rows of six, the Brownian
    wrenches, and finite
>>> mm.describe(model(wrenches="nan 0 0 0 0 0"))
DeclarationError(wrench, 1): body 1 'needle': its user numbers must be rows of six, the ...
>>> mm.describe(model(potential="0 0.3 1"))
DeclarationError(potential, 0): joint 0 'turn': its user numbers must be pairs, the finite Fourier
    coefficients of a potential, and the joint must be a slide or a hinge
>>> mm.describe(model(potential="0 inf"))
DeclarationError(potential, 0): joint 0 'turn': its user numbers must be pairs, the finite ...
>>> mm.describe(model(of_flight="1 1"))
DeclarationError(potential, 1): joint 1 'flight': its user numbers must be pairs, the finite
    Fourier coefficients of a potential, and the joint must be a slide or a hinge
>>> model(wrenches=13 * "1 ", plugin=True)
ValueError: Error: engine error: body 1 'needle': its user numbers must be rows of six, the
    Brownian wrenches, and finite
>>> model(potential="0 0.3 1", plugin=True)
ValueError: Error: engine error: joint 0 'turn': its user numbers must be pairs, the finite
    Fourier coefficients of a potential, and the joint must be a slide or a hinge

# Couplings
>>> mm.describe(model(coupling("body needle 2")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies with
    equal and finite prm
>>> mm.describe(model(coupling("body needle 2", "body ball 2", "body base 2")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies ...
>>> mm.describe(model(coupling("body needle 2", "body ball 3")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies ...
>>> mm.describe(model(coupling("body needle nan", "body ball nan")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies ...
>>> mm.describe(model(coupling("body needle inf", "body ball inf")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies ...
>>> mm.describe(model(coupling("body needle -inf", "body ball -inf")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies ...
>>> mm.describe(model(coupling("site hand 2", "site ball 2")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies ...
>>> mm.describe(model(coupling("xbody needle 2", "xbody ball 2")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies ...
>>> mm.describe(model(coupling("xbody needle 2", "body ball 2")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies ...
>>> mm.describe(model(coupling("body needle 2", "site ball 2")))
DeclarationError(coupling, 1): coupling tuple 1 'coupling#': its elements must be two bodies ...
>>> model(coupling("body needle 3", "body ball 2"), plugin=True)
ValueError: Error: engine error: coupling tuple 1 'coupling#': its elements must be two bodies
    with equal and finite prm

# Coils
>>> mm.describe(model(group("coil", "site hand")))
DeclarationError(coil, 0): coil tuple 0 'coil': element 0, site 'hand', must be an actuator, since
    it is the first
>>> mm.describe(model(group("coil", "actuator current")))
DeclarationError(coil, 0): coil tuple 0 'coil' must name a geom, a site or a body after its
    actuator
>>> mm.describe(model(group("coil", "actuator current -1", "site hand")))
DeclarationError(coil, 0): coil tuple 0 'coil': element 0, actuator 'current', has prm = -1, the
    drive near which its core saturates: must be finite and at least 0 (0: never)
>>> mm.describe(model(group("coil", "actuator current inf", "site hand")))
DeclarationError(coil, 0): coil tuple 0 'coil': element 0, actuator 'current', has prm = inf, the
    drive near which its core saturates: must be finite and at least 0 (0: never)
>>> mm.describe(model(group("coil", "actuator current", "site hand", "site hand")))
DeclarationError(coil, 0): coil tuple 0 'coil': element 2, site 'hand', is also named by coil
    tuple 0
>>> first = group("coil", "actuator current", "site hand")
>>> mm.describe(model(first, group("coil_2", "actuator current", "site fixed", "site hand")))
DeclarationError(coil, 1): coil tuple 1 'coil_2': element 2, site 'hand', is also named by coil
    tuple 0
>>> mm.describe(model(group("coil", "actuator current", "site hand", "body needle")))
DeclarationError(coil, 0): coil tuple 0 'coil': element 1, site 'hand', is a part of a body that
    coil tuple 0 names
>>> mm.describe(model(group("coil", "actuator current", "joint turn")))
DeclarationError(coil, 0): coil tuple 0 'coil': element 1, joint 'turn', must be a geom, a site or
    a body
>>> mm.describe(model(group("coil", "actuator current", "geom ball", "geom ball"), of_geom="0 0 1"))
DeclarationError(coil, 0): coil tuple 0 'coil': element 2, geom 'ball', is also named by coil
    tuple 0
>>> mm.describe(model(group("coil", "actuator current", "geom core")))
DeclarationError(coil, 0): coil tuple 0 'coil': element 1, geom 'core', has no polarization: its
    user numbers must be mu0 N I/L in T at a drive of 1, along the axis of the coil
>>> mm.describe(model(group("coil", "actuator current", "geom core"), of_geom="0 0 1"))
DeclarationError(coil, 0): coil tuple 0 'coil': element 1, geom 'core', has no polarization: its
    user numbers must be mu0 N I/L in T at a drive of 1, along the axis of the coil
>>> mm.describe(model(group("coil", "actuator current", "geom ball"), of_geom="0 0 1"))
DeclarationError(coil, 0): coil tuple 0 'coil': element 1, geom 'ball', must be a cylinder with a
    polarization along its z axis, or a box with one along x, y or z
>>> mm.describe(model(group("coil", "actuator late", "site hand")))
DeclarationError(coil, 0): coil tuple 0 'coil': element 0, actuator 'late', must not have a delay
>>> model(group("coil", "actuator nobody"))
ValueError: Error: unrecognized object 'nobody' in tuple 0
Element name 'coil', id 0, line 4
>>> model(group("coil", "actuator current", "geom core"), plugin=True)
ValueError: Error: engine error: coil tuple 0 'coil': element 1, geom 'core', has no polarization:
    its user numbers must be mu0 N I/L in T at a drive of 1, along the axis of the coil

# Numbers of fields
>>> mm.describe(model(numeric("field", "1 2")))
DeclarationError(field, 0): numeric 0 'field': a field must be B in T (3 finite numbers), B and
    G_xx G_xy G_xz G_yy G_yz in T/m (8), or a table: numbers of nodes n_x n_y n_z, each at least
    4, the first node x y z, positive spacings, and 3 n_x n_y n_z flux densities
>>> mm.describe(model(numeric("field", "1 2 nan")))
DeclarationError(field, 0): numeric 0 'field': a field must be B in T (3 finite numbers), B ...
>>> mm.describe(model(numeric("field", f"3 4 4 {GRID}" + 3 * 48 * " 1")))
DeclarationError(field, 0): numeric 0 'field': a field must be B in T (3 finite numbers), B ...
>>> mm.describe(model(numeric("field", f"4.5 4 4 {GRID}" + 3 * 72 * " 1")))
DeclarationError(field, 0): numeric 0 'field': a field must be B in T (3 finite numbers), B ...
>>> mm.describe(model(numeric("field", "4 4 4 0 0 0 1 0 1" + 3 * 64 * " 1")))
DeclarationError(field, 0): numeric 0 'field': a field must be B in T (3 finite numbers), B ...
>>> mm.describe(model(numeric("field", f"4 4 4 {GRID}" + (3 * 64 + 1) * " 1")))
DeclarationError(field, 0): numeric 0 'field': a field must be B in T (3 finite numbers), B ...

# A node of a field that is not finite
>>> mm.describe(model(numeric("field", f"4 4 4 {GRID}" + (3 * 64 - 1) * " 1" + " nan")))
DeclarationError(field, 0): numeric 0 'field': a field must be B in T (3 finite numbers), B and
    G_xx G_xy G_xz G_yy G_yz in T/m (8), or a table: numbers of nodes n_x n_y n_z, each at least
    4, the first node x y z, positive spacings, and 3 n_x n_y n_z flux densities

# Tuples of fields
>>> mm.describe(model(group("field too", "body needle")))
DeclarationError(field_tuple, 0): field tuple 0 'field too' must name a numeric that is a field
>>> mm.describe(model(field("1 2 3", "geom core")))
DeclarationError(field_tuple, 0): field tuple 0 'field too': element 1, geom 'core', must be a
    numeric, a body, a site or an actuator
>>> mm.describe(model(field("1 2 3", "body needle", "body needle")))
DeclarationError(field_tuple, 0): field tuple 0 'field too': element 2, body 'needle', is one too
    many: at most one body or site, and at most one actuator
>>> mm.describe(model(field("1 2 3", "body needle", "site hand")))
DeclarationError(field_tuple, 0): field tuple 0 'field too': element 2, site 'hand', is one too
    many: at most one body or site, and at most one actuator
>>> mm.describe(model(field("1 2 3", "actuator current", "actuator current")))
DeclarationError(field_tuple, 0): field tuple 0 'field too': element 2, actuator 'current', is one
    too many: at most one body or site, and at most one actuator
>>> mm.describe(model(field("1 2 3", "actuator late")))
DeclarationError(field_tuple, 0): field tuple 0 'field too': element 1, actuator 'late', must not
    have a delay
>>> mm.describe(model(field("1 2 3", "actuator current -1")))
DeclarationError(field_tuple, 0): field tuple 0 'field too': element 1, actuator 'current', has
    prm = -1, the drive near which its core saturates: must be finite and at least 0 (0: never)
>>> mm.describe(model(field("1 2 3"), group("field_again", "numeric field")))
DeclarationError(field_tuple, 1): field tuple 1 'field_again': element 0, numeric 'field', is also
    named by field tuple 0
>>> mm.describe(model(numeric("other", "1"), group("field too", "numeric other")))
DeclarationError(field_tuple, 0): field tuple 0 'field too': element 0, numeric 'other', must have
    a name that starts with 'field'

# Iron
>>> mm.describe(model(iron("geom core", material="-1.5")))
DeclarationError(material, 0): numeric 0 'material' = -1.5: a material must be a susceptibility,
    at least -1, and optionally a saturation magnetization in A/m and the distance of nodes in m,
    not negative; all finite
>>> mm.describe(model(iron("geom core", material="5 -1")))
DeclarationError(material, 0): numeric 0 'material' = 5 -1: a material must be a susceptibility,
    at least -1, and optionally a saturation magnetization in A/m and the distance of nodes in m,
    not negative; all finite
>>> mm.describe(model(iron()))
DeclarationError(iron, 0): iron tuple 0 'iron' must name a numeric, the material, and a geom
>>> mm.describe(model(iron("geom core", "geom core")))
DeclarationError(iron, 0): iron tuple 0 'iron': element 2, geom 'core', is also named by iron
    tuple 0
>>> mm.describe(model(iron("geom floor", "geom table")))
DeclarationError(iron, 0): iron tuple 0 'iron': element 2, geom 'table', is one too many: one
    numeric in the tuple, and at most one plane in the model
>>> mm.describe(model(iron("geom core", "site hand")))
DeclarationError(iron, 0): iron tuple 0 'iron': element 2, site 'hand', must be a numeric or a
    geom
>>> mm.describe(model(iron("geom core", "numeric material")))
DeclarationError(iron, 0): iron tuple 0 'iron': element 2, numeric 'material', is one too many:
    one numeric in the tuple, and at most one plane in the model
>>> mm.describe(model(iron("geom core"), group("iron_2", "numeric material", "geom core")))
DeclarationError(iron, 1): iron tuple 1 'iron_2': element 1, geom 'core', is also named by iron
    tuple 0
>>> mm.describe(model(iron("geom core"), group("coupling", "body needle 2", "body ball 2")))
DeclarationError(coupled_iron, 3): iron geom 3 'core' belongs to a body of coupling tuple 1
    'coupling': couplings do not apply to iron
>>> mm.describe(sized("core", math.nan))
DeclarationError(size, 3): geom 3 'core': the size of iron and of magnets must be positive and
    finite
>>> mm.describe(sized("core", math.inf))
DeclarationError(size, 3): geom 3 'core': the size of iron and of magnets must be positive and
    finite
>>> mm.describe(sized("core", 0))
DeclarationError(size, 3): geom 3 'core': the size of iron and of magnets must be positive and
    finite
>>> mm.describe(sized("core", -1))
DeclarationError(size, 3): geom 3 'core': the size of iron and of magnets must be positive and
    finite
>>> mm.describe(sized("bar", 1, math.nan))
DeclarationError(size, 2): geom 2 'bar': the size of iron and of magnets must be positive and
    finite
>>> mm.describe(sized("bar", 1, math.inf))
DeclarationError(size, 2): geom 2 'bar': the size of iron and of magnets must be positive and
    finite
>>> mm.describe(sized("bar", 1, -1))
DeclarationError(size, 2): geom 2 'bar': the size of iron and of magnets must be positive and
    finite
>>> mm.describe(sized("bar", 1, 0))
DeclarationError(size, 2): geom 2 'bar': the size of iron and of magnets must be positive and
    finite
>>> found = model(iron("geom core"))
>>> found.numeric_size[0] = 0
>>> mm.describe(found)
DeclarationError(material, 0): numeric 0 'material' = no number: a material must be a
    susceptibility, at least -1, and optionally a saturation magnetization in A/m and the distance
    of nodes in m, not negative; all finite

# The magnetic constant and the tolerance
>>> mm.describe(model(numeric("magnetic_constant", "0")))
DeclarationError(constant, 0): numeric 0 'magnetic_constant': the magnetic constant must be one
    positive finite number, mu0 in the units of the model
>>> mm.describe(model(numeric("magnetic_constant", "-1e-3")))
DeclarationError(constant, 0): numeric 0 'magnetic_constant': the magnetic constant must be ...
>>> mm.describe(changed("magnetic_constant", math.inf))
DeclarationError(constant, 0): numeric 0 'magnetic_constant': the magnetic constant must be ...
>>> mm.describe(changed("magnetic_constant", math.nan))
DeclarationError(constant, 0): numeric 0 'magnetic_constant': the magnetic constant must be ...
>>> mm.describe(model(numeric("magnetic_constant", "1e-3 1e-3")))
DeclarationError(constant, 0): numeric 0 'magnetic_constant': the magnetic constant must be ...
>>> mm.describe(changed("magnetic_tolerance", -1e-3))
DeclarationError(tolerance, 0): numeric 0 'magnetic_tolerance': the tolerance must be one number
    from 0 (exact) to 0.1
>>> mm.describe(changed("magnetic_tolerance", 0.2))
DeclarationError(tolerance, 0): numeric 0 'magnetic_tolerance': the tolerance must be one ...
>>> mm.describe(changed("magnetic_tolerance", math.inf))
DeclarationError(tolerance, 0): numeric 0 'magnetic_tolerance': the tolerance must be one ...
>>> mm.describe(changed("magnetic_tolerance", math.nan))
DeclarationError(tolerance, 0): numeric 0 'magnetic_tolerance': the tolerance must be one ...
>>> mm.describe(changed("magnetic_tolerance", 1e-3, 1e-3))
DeclarationError(tolerance, 0): numeric 0 'magnetic_tolerance': the tolerance must be one ...

# The first of several errors
>>> of_three = group("coupling", "body needle 2", "site hand 2", "body ball 2")
>>> mm.describe(model(of_three))
DeclarationError(coupling, 0): coupling tuple 0 'coupling': its elements must be two bodies with
    equal and finite prm
>>> mm.describe(model(of_three, group("coil", "body ball")))
DeclarationError(coupling, 0): coupling tuple 0 'coupling': its elements must be two bodies ...
"""
