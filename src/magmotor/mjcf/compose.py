"""`add_dipole` and others: what a model declares by MJCF, added to an `MjSpec`.

They also add the plugin `magmotor.forces` and the mark, a text that says what acts. They write no
key `act`, since `MjSpec.attach` drops the plugin with its keys. It keeps texts, tuples and
numerics, but puts a prefix before their names, so that they declare nothing. The mark of an
attached spec says what the prefix is, and which of the names were declarations.
"""

from collections.abc import Iterable, Sequence
from typing import Annotated, Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import ArrayLike

import magmotor_plugin
from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_array, reject
from magmotor.common.hints import NotNegative, Positive, number, several
from magmotor.mjcf.declarations.fields import are_valid
from magmotor.mjcf.declarations.marks import WORDS
from magmotor.mjcf.field_table import Vector
from magmotor.mjcf.idle import NUMERICS, PREFIXES
from magmotor.mjcf.magnets.magnet import SI, Error, Magnet, Units, elements_of
from magmotor.mjcf.sentences import FIELD_RULE, MARK_NAME

FORCES, INSTANCE = magmotor_plugin.FORCES.decode(), "magnets"
"""The plugin, and the name of its instance."""

Place = mujoco.MjsBody | mujoco.MjsFrame
Element = mujoco.MjsActuator | mujoco.MjsBody | mujoco.MjsGeom | mujoco.MjsNumeric | mujoco.MjsSite
Geoms = Annotated[Sequence[mujoco.MjsGeom], several(mujoco.MjsGeom)]
Susceptibility = Annotated[float, number(at_least=-1)]

TYPES = {
    mujoco.MjsActuator: mujoco.mjtObj.mjOBJ_ACTUATOR,
    mujoco.MjsBody: mujoco.mjtObj.mjOBJ_BODY,
    mujoco.MjsGeom: mujoco.mjtObj.mjOBJ_GEOM,
    mujoco.MjsNumeric: mujoco.mjtObj.mjOBJ_NUMERIC,
    mujoco.MjsSite: mujoco.mjtObj.mjOBJ_SITE,
}
"""Types of the elements that tuples list."""


@checked
def add_dipole(
    spec: mujoco.MjSpec,
    body: Place,
    moment: float,
    *,
    pos: Vector = (0.0, 0.0, 0.0),
    zaxis: Vector = (0.0, 0.0, 1.0),
    name: str = "",
) -> mujoco.MjsSite:
    """Add a magnetic dipole, a site with a `user` number, to a body of an `MjSpec`.

    Parameters
    ----------
    spec : mujoco.MjSpec
    body : mujoco.MjsBody or mujoco.MjsFrame
        A body of the spec, such as `spec.worldbody`, or one of its frames.
    moment : float
        In A m^2, along the site's z axis.
    pos : array_like, shape (3,)
        Position in m, in the frame of `body`.
    zaxis : array_like, shape (3,)
        Direction of the moment there, of any length; along z by default.
    name : str
        Name of the site; by default, it has none.

    Returns
    -------
    mujoco.MjsSite

    Raises
    ------
    ValueError
        An argument is invalid, the body is not in the spec, or the name is taken; also as for
        `add_magnetism`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> spec = mujoco.MjSpec()
    >>> needle = spec.worldbody.add_body(name="needle")
    >>> hinge = needle.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, damping=1e-4)
    >>> needle.mass, needle.inertia, needle.explicitinertial = 0.002, [1e-6, 1e-6, 1e-6], True
    >>> site = mm.add_dipole(spec, needle, 0.2, zaxis=[1, 0, 0], name="needle")
    >>> magnet = mm.add_dipole(spec, spec.worldbody, 5, pos=[0, 0.1, 0], zaxis=[0, 1, 0])
    >>> model = spec.compile()
    >>> data = mujoco.MjData(model)
    >>> mujoco.mj_step(model, data, nstep=5000)
    >>> print(data.qpos.round(4))
    [1.5708]
    """
    _check_owner(spec, "body", body)
    _check_new(spec, "site", name)
    if not np.any(zaxis):
        raise reject("zaxis", zaxis, "must not be zero")
    site = body.add_site(name=name, pos=_list(pos), zaxis=_list(zaxis), userdata=[moment])
    _let_act(spec, "dipoles")
    return site


@checked
def add_magnet(
    spec: mujoco.MjSpec,
    body: Place,
    magnet: Magnet,
    *,
    error: Error,
    gap: Positive,
    name: str = "",
    units: Units = SI,
) -> tuple[list[mujoco.MjsGeom], list[mujoco.MjsSite]]:
    """Add a permanent magnet, its geoms and dipoles, to a body of an `MjSpec`.

    Parameters
    ----------
    spec : mujoco.MjSpec
    body : mujoco.MjsBody or mujoco.MjsFrame
        A body of the spec, or one of its frames, such as `body.add_frame(pos=..., euler=...)`, in
        which the magnet is centered at the origin.
    magnet : Magnet
        Its shape, size and material; see `magnet`.
    error : float
        Largest relative error of the field and of forces; see `Magnet.dipoles`.
    gap : float
        Smallest distance from the magnet's surface, in m, at which they are so accurate.
    name : str
        Name of the geom. The sites, and the boxes of a ring, add a number to it. By default,
        nothing is named.
    units : tuple of float, default (1.0, 1.0, 1.0)
        Units of the spec; see `Magnet.mjcf`.

    Returns
    -------
    geoms : list of mujoco.MjsGeom
        One with size and mass; of a ring, also boxes around the hole.
    sites : list of mujoco.MjsSite
        The dipoles.

    Raises
    ------
    ValueError
        As for `Magnet.dipoles`, the body is not in the spec, or a name is taken; also as for
        `add_magnetism`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> spec = mujoco.MjSpec()
    >>> body = spec.worldbody.add_body()
    >>> disk = mm.magnet("cylinder", (0.01, 0.005), grade="N42")
    >>> geoms, sites = mm.add_magnet(spec, body, disk, error=0.01, gap=0.01, name="disk")
    >>> print(geoms[0].name, len(sites))
    disk 20
    """
    _check_owner(spec, "body", body)
    elements = [*elements_of(magnet, error, gap, name, units)]
    for tag, attributes in elements:
        _check_new(spec, tag, attributes.get("name", ""))
    geoms = [body.add_geom(**_arguments(each)) for tag, each in elements if tag == "geom"]
    sites = [body.add_site(**_arguments(each)) for tag, each in elements if tag == "site"]
    _let_act(spec, "dipoles")
    return geoms, sites


@checked
def add_coil(
    spec: mujoco.MjSpec,
    actuator: mujoco.MjsActuator,
    dipoles: Sequence[mujoco.MjsSite | mujoco.MjsBody],
    *,
    saturation: NotNegative = 0.0,
    name: str = "coil",
) -> mujoco.MjsTuple:
    """Add a coil to an `MjSpec`: a tuple by which an actuator scales the moments of dipoles.

    Parameters
    ----------
    spec : mujoco.MjSpec
    actuator : mujoco.MjsActuator
        Its last activation, or its control if it has none, multiplies the moments. With ten zeros
        as `gainprm`, it does not push.
    dipoles : sequence of mujoco.MjsSite and mujoco.MjsBody
        Sites with a moment, as `add_dipole` returns them; a body stands for all of its own.
    saturation : float, default 0.0
        The drive near which the core saturates; 0 without saturation.
    name : str, default "coil"
        Name of the tuple, which must start with `coil`.

    Returns
    -------
    mujoco.MjsTuple

    Raises
    ------
    ValueError
        An argument is invalid, an element is not in the spec or has no name, or the name of the
        coil is taken; also as for `add_magnetism`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> spec = mujoco.MjSpec()
    >>> tip = mm.add_dipole(spec, spec.worldbody, 2, name="tip")
    >>> current = spec.add_actuator(
    ...     name="current", trntype=mujoco.mjtTrn.mjTRN_SITE, target="tip", gainprm=[0] * 10
    ... )
    >>> print(mm.add_coil(spec, current, [tip], saturation=1.5).name)
    coil
    """
    if not dipoles:
        raise reject("dipoles", dipoles, "must be at least one site or body")
    listed = [_listed(spec, f"dipoles[{k}]", dipole) for k, dipole in enumerate(dipoles)]
    listed = [(*_listed(spec, "actuator", actuator)[:2], saturation), *listed]
    _check_new(spec, "tuple", name, "coil")
    added = _add_tuple(spec, name, listed)
    _let_act(spec, "coils")
    return added


@checked
def add_field(
    spec: mujoco.MjSpec,
    field: Any,
    *,
    frame: mujoco.MjsBody | mujoco.MjsSite | None = None,
    actuator: mujoco.MjsActuator | None = None,
    saturation: NotNegative = 0.0,
    name: str = "",
) -> mujoco.MjsNumeric:
    """Add an applied field to an `MjSpec`: a numeric and, if it has a frame or a drive, a tuple.

    Parameters
    ----------
    spec : mujoco.MjSpec
    field : array_like or str
        B_x B_y B_z in T; these, and the derivatives G_xx G_xy G_xz G_yy G_yz in T/m; or a table, as
        numbers or as the MJCF that `tabulated_field` returns.
    frame : mujoco.MjsBody or mujoco.MjsSite, optional
        To which the field is fixed, and which feels the reaction; the world by default.
    actuator : mujoco.MjsActuator, optional
        Scales the field, as it scales the moments of a coil; see `add_coil`.
    saturation : float, default 0.0
        The drive near which the core saturates; 0 without saturation.
    name : str
        Name of the numeric and of the tuple, which must start with `field` and be one word. By
        default, it is that of the table's MJCF, or else `field`.

    Returns
    -------
    mujoco.MjsNumeric

    Raises
    ------
    ValueError
        An argument is invalid, an element is not in the spec or has no name, or the name of the
        field is taken; also as for `add_magnetism`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> spec = mujoco.MjSpec()
    >>> print(mm.add_field(spec, [0, 0, 0.02]).name)
    field
    """
    default, numbers = _numbers_of(field)
    name = name or default
    _check_new(spec, "numeric", name, "field")
    places = {"frame": frame, "actuator": actuator}
    listed = [_listed(spec, what, each) for what, each in places.items() if each is not None]
    if actuator is not None:
        listed[-1] = (*listed[-1][:2], saturation)
    elif saturation:
        raise reject("saturation", saturation, "must be 0 without an actuator")
    if listed:
        _check_new(spec, "tuple", name, "field")
    added = spec.add_numeric(name=name, data=_list(numbers), size=len(numbers))
    if listed:
        _add_tuple(spec, name, [_listed(spec, "field", added), *listed])
    _let_act(spec, "fields")
    return added


@checked
def add_iron(
    spec: mujoco.MjSpec,
    geoms: Geoms,
    susceptibility: Susceptibility,
    saturation: NotNegative = 0.0,
    *,
    name: str = "iron",
) -> mujoco.MjsTuple:
    """Add iron to an `MjSpec`: a tuple of geoms and their material, a numeric of the same name.

    Parameters
    ----------
    spec : mujoco.MjSpec
    geoms : sequence of mujoco.MjsGeom
        Spheres, ellipsoids, capsules, cylinders and boxes; or a plane, a half-space.
    susceptibility : float
        At least -1.
    saturation : float, default 0.0
        Saturation magnetization in A/m, such as 1.7e6 of pure iron; 0 without saturation.
    name : str, default "iron"
        Name of the tuple and of the numeric, which must start with `iron` and be one word.

    Returns
    -------
    mujoco.MjsTuple

    Raises
    ------
    ValueError
        An argument is invalid, a geom is not in the spec or has no name, or the name of the iron is
        taken; also as for `add_magnetism`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> spec = mujoco.MjSpec()
    >>> pellet = spec.worldbody.add_geom(name="pellet", size=[0.005, 0, 0])
    >>> print(*mm.add_iron(spec, [pellet], 5000, 1.7e6).objname)
    iron pellet
    """
    listed = [_listed(spec, f"geoms[{k}]", geom) for k, geom in enumerate(geoms)]
    for kind in ("numeric", "tuple"):
        _check_new(spec, kind, name, "iron")
    numbers = [susceptibility, saturation] if saturation else [susceptibility]
    material = spec.add_numeric(name=name, data=numbers, size=len(numbers))
    added = _add_tuple(spec, name, [_listed(spec, "iron", material), *listed])
    _let_act(spec, "iron")
    return added


@checked
def add_magnetism(spec: mujoco.MjSpec) -> None:
    """Let everything magnetic in an `MjSpec` act, also what others brought that were attached.

    The other functions that add something do so, too. Call this one after `MjSpec.attach`, which
    drops the plugin, and puts a prefix before the names of the mark, fields, coils, iron and
    couplings, so that they are none. Names such as `hand/coil` become `coil_hand/coil`. Specs that
    these functions have composed have a mark, from which the prefix is known; call this function
    for any other spec before it is attached.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Gets the plugin `magmotor.forces` and a mark, whose words are those of its own mark, of its
        plugin's key `act`, and of the marks of attached specs. Without any of these, dipoles act.
        The sizes `nuser_site`, `nuser_body` and `nuser_jnt`, if set, increase to what is needed.

    Raises
    ------
    ValueError
        An attached spec has another `magnetic_constant` or `magnetic_tolerance` than the spec, or
        another plugin's instance is named `magnets`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> hand, arm = mujoco.MjSpec(), mujoco.MjSpec()
    >>> field = mm.add_field(hand, [0, 0, 0.02])
    >>> _ = arm.attach(hand, prefix="hand/", frame=arm.worldbody.add_frame())
    >>> mm.add_magnetism(arm)
    >>> print(arm.numerics[0].name, arm.texts[0].data)
    field_hand/field fields
    """
    _let_act(spec)


def _let_act(spec: mujoco.MjSpec, *added: str) -> None:
    """Add or complete the plugin and the mark, with the words of what was added."""
    instance = next((each for each in spec.plugins if each.plugin_name == FORCES), None)
    if instance is None:
        if spec.plugin(INSTANCE) is not None:
            sentence = f"must be that of {FORCES}, which needs this name for its instance"
            raise reject(f"plugin {INSTANCE!r}", spec.plugin(INSTANCE).plugin_name, sentence)
        spec.activate_plugin(FORCES)
        instance = spec.add_plugin(name=INSTANCE, plugin_name=FORCES, active=True)
    mark = spec.text(MARK_NAME)
    words = [*(mark.data.split() if mark else []), *instance.config.get("act", "").split()]
    for text in spec.texts:
        prefix, found, suffix = text.name.rpartition(MARK_NAME)
        act = text.data.split()
        if found and text.name != MARK_NAME and act and {*act} <= {*WORDS}:
            _give_names_back(spec, prefix, suffix, act)
            spec.delete(text)
            words += act
    if not words and (not added or any(np.any(site.userdata) for site in spec.sites)):
        words = ["dipoles"]
    data = "all" if "all" in words else " ".join(dict.fromkeys([*words, *added]))
    if mark:
        mark.data = data
    else:
        spec.add_text(name=MARK_NAME, data=data)
    instance.config = {}  # which would have to have the same words
    for size, elements in (
        ("nuser_site", spec.sites), ("nuser_body", spec.bodies), ("nuser_jnt", spec.joints)
    ):  # fmt: skip
        if getattr(spec, size) >= 0:  # else MuJoCo counts
            longest = max((len(each.userdata) for each in elements), default=0)
            setattr(spec, size, max(getattr(spec, size), longest))


def _give_names_back(spec: mujoco.MjSpec, prefix: str, suffix: str, words: Iterable[str]) -> None:
    """Put the word in front of names of an attached spec that started with it, if it is marked."""
    for name in NUMERICS:
        attached, own = spec.numeric(f"{prefix}{name}{suffix}"), spec.numeric(name)
        if attached is not None and attached is not own:
            if own is None or not np.array_equal(attached.data, own.data):
                given = "nothing" if own is None else own.data[0]
                sentence = f"must be that of the whole spec, {name} = {given}, since units agree"
                raise reject(f"numeric {attached.name!r}", attached.data[0], sentence)
            spec.delete(attached)
    marked = [each for each in PREFIXES if {"all", each, f"{each}s"} & {*words}] if prefix else []
    fields: dict[str, str] = {}
    for word in marked:
        for each in [*spec.tuples, *(spec.numerics if word == "field" else ())]:
            if each.name.startswith(prefix + word) and each.name.endswith(suffix):
                name = f"{word}_{each.name}"
                if isinstance(each, mujoco.MjsNumeric):
                    fields[each.name] = name
                each.name = name
    for each in spec.tuples:
        numeric = [kind == mujoco.mjtObj.mjOBJ_NUMERIC for kind in each.objtype]
        names = zip(each.objname, numeric, strict=True)
        each.objname = [fields.get(name, name) if is_one else name for name, is_one in names]


def _add_tuple(
    spec: mujoco.MjSpec, name: str, listed: Sequence[tuple[Any, str, float]]
) -> mujoco.MjsTuple:
    """Add a tuple of elements, of which types, names and `prm` are given."""
    types, names, numbers = map(list, zip(*listed, strict=True))
    return spec.add_tuple(name=name, objtype=types, objname=names, objprm=numbers)


def _listed(spec: mujoco.MjSpec, argument: str, element: Any) -> tuple[Any, str, float]:
    """Return type, name and `prm` of an element for a tuple; check that it can be listed."""
    _check_owner(spec, argument, element)
    if element.name.split() != [element.name]:
        sentence = "must be one word, since a tuple lists names with spaces between them"
        raise reject(f"name of {argument}", element.name, sentence)
    return TYPES[type(element)], element.name, 0.0


def _check_owner(spec: mujoco.MjSpec, argument: str, element: Any) -> None:
    """Check that an element is a part of a spec."""
    top = element
    while getattr(top, "parent", None) is not None:
        top = top.parent
    owned = top in (spec.worldbody, *spec.actuators, *spec.numerics)
    if not owned:
        raise reject(argument, element.name, "must be in the spec, not in another one")


def _check_new(spec: mujoco.MjSpec, kind: str, name: str, word: str = "") -> None:
    """Check that a name starts with a word, if one is given, and is not taken."""
    single = kind == "tuple" or name.split() == [name]
    if not name.startswith(word) or (word and not single):
        one = "" if kind == "tuple" else " and be one word"
        raise reject("name", name, f"must start with {word!r}{one}")
    if name and getattr(spec, kind)(name) is not None:
        raise reject("name", name, f"must be new, since the spec has a {kind} of this name")


def _numbers_of(field: Any) -> tuple[str, Array]:
    """Return the name of a field, `field` unless it is MJCF, and its numbers."""
    name, numbers = "field", field
    if isinstance(field, str):
        try:
            element = ElementTree.fromstring(field)
            name, numbers = element.attrib["name"], [*map(float, element.attrib["data"].split())]
        except (ElementTree.ParseError, KeyError, ValueError):
            sentence = "must be numbers, or MJCF as tabulated_field returns it"
            raise reject("field", field, sentence) from None
    array = check_array("field", numbers, "n")
    if not are_valid(array.tolist(), thorough=True):
        raise reject("field", numbers, FIELD_RULE)
    return name, array


def _arguments(attributes: dict[str, Any]) -> dict[str, Any]:
    """Return attributes of MJCF as arguments of `add_geom` and `add_site`."""
    given = dict(attributes)
    if "type" in given:
        given["type"] = getattr(mujoco.mjtGeom, f"mjGEOM_{given['type'].upper()}")
    if "user" in given:
        given["userdata"] = [given.pop("user")]
    return {key: np.atleast_1d(value) if key == "size" else value for key, value in given.items()}


def _list(numbers: ArrayLike) -> list[float]:
    return np.asarray(numbers, float).tolist()
