"""`add_dipole` and others: what a model declares by MJCF, added to an `MjSpec`.

Cross-references, such as that no site is in two coils, are checked where any model is compiled.
"""

from collections.abc import Sequence
from typing import Annotated, Any
from xml.etree import ElementTree

import mujoco
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.checks import check_array
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import NotNegative, Positive, number, several, shaped
from magmotor.mjcf.declarations.fields import are_valid
from magmotor.mjcf.error_sentences import FIELD_RULE
from magmotor.mjcf.magnets.magnet import SI, Error, Magnet, Units, elements_of
from magmotor.mjcf.spec_mark import let_act

Place = mujoco.MjsBody | mujoco.MjsFrame
Vector = Annotated[Sequence[float], shaped(3)]
Geoms = Annotated[Sequence[mujoco.MjsGeom], several(mujoco.MjsGeom)]
Sites = Annotated[Sequence[mujoco.MjsSite], several(mujoco.MjsSite)]
Ratio = Annotated[float, number(above=0, below=1)]
Susceptibility = Annotated[float, number(at_least=-1)]

TYPES = {
    mujoco.MjsActuator: mujoco.mjtObj.mjOBJ_ACTUATOR,
    mujoco.MjsBody: mujoco.mjtObj.mjOBJ_BODY,
    mujoco.MjsGeom: mujoco.mjtObj.mjOBJ_GEOM,
    mujoco.MjsSite: mujoco.mjtObj.mjOBJ_SITE,
}
"""Types of the elements that tuples list besides numerics."""

NUMERIC = mujoco.mjtObj.mjOBJ_NUMERIC
Listed = tuple[mujoco.mjtObj, str, float]
"""Type, name and `prm` of an element of a tuple."""


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
        raise ArgumentError("zaxis", zaxis, "must not be zero")
    site = body.add_site(name=name, pos=pos, zaxis=zaxis, userdata=[moment])
    let_act(spec, "dipoles")
    return site


@checked
def add_magnet(
    spec: mujoco.MjSpec,
    body: Place,
    magnet: Magnet,
    *,
    error: Error | None = None,
    gap: Positive | None = None,
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
    error, gap : float, optional
        Without them, the geom is the magnet: its polarization is its `user`. With both, dipoles
        represent it, with this largest relative error of the field and of forces at this smallest
        distance in m from its surface; see `Magnet.dipoles`.
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
        The dipoles, if the geom is not the magnet.

    Raises
    ------
    ValueError
        As for `Magnet.mjcf`, the body is not in the spec, or a name is taken; also as for
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
    geoms, sites = (
        [_add(body, tag, attributes) for tag, attributes in elements if tag == kind]
        for kind in ("geom", "site")
    )
    let_act(spec, "dipoles" if sites else "magnets")
    return geoms, sites


@checked
def add_coil(
    spec: mujoco.MjSpec,
    actuator: mujoco.MjsActuator,
    dipoles: Sequence[mujoco.MjsBody | mujoco.MjsSite | mujoco.MjsGeom],
    *,
    saturation: NotNegative = 0.0,
    name: str = "coil",
) -> mujoco.MjsTuple:
    """Add a coil to an `MjSpec`: a tuple by which an actuator scales the moments of magnets.

    Parameters
    ----------
    spec : mujoco.MjSpec
    actuator : mujoco.MjsActuator
        Its last activation, or its control if it has none, multiplies the moments. With ten zeros
        as `gainprm`, it does not push.
    dipoles : sequence of mujoco.MjsSite, mujoco.MjsBody and mujoco.MjsGeom
        Sites with a moment, as `add_dipole` returns them; a body stands for all of its own. A geom,
        a cylinder or a box, has a winding on its side: its `userdata` is mu0 N I/L in T at a drive
        of 1, along its axis.
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
        raise ArgumentError("dipoles", dipoles, "must be at least one geom, site or body")
    listed = [_listed(spec, f"dipoles[{k}]", dipole) for k, dipole in enumerate(dipoles)]
    listed = [_listed(spec, "actuator", actuator, saturation), *listed]
    _check_new(spec, "tuple", name, "coil")
    added = _add_tuple(spec, name, listed)
    let_act(spec, "coils")
    if any(isinstance(dipole, mujoco.MjsGeom) for dipole in dipoles):
        let_act(spec, "magnets")
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
    for kind in ("numeric", "tuple"):
        _check_new(spec, kind, name, "field")
    listed = [(NUMERIC, name, 0.0)]
    if frame is not None:
        listed.append(_listed(spec, "frame", frame))
    if actuator is not None:
        listed.append(_listed(spec, "actuator", actuator, saturation))
    elif saturation:
        raise ArgumentError("saturation", saturation, "must be 0 without an actuator")
    added = spec.add_numeric(name=name, data=numbers, size=len(numbers))
    if len(listed) > 1:
        _add_tuple(spec, name, listed)
    let_act(spec, "fields")
    return added


@checked
def add_iron(
    spec: mujoco.MjSpec,
    geoms: Geoms,
    susceptibility: Susceptibility,
    saturation: NotNegative = 0.0,
    spacing: NotNegative = 0.0,
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
    spacing : float, default 0.0
        Distance of the nodes on the surfaces in m; 0 for one by which a piece has about a hundred.
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
    numbers = [susceptibility, saturation] if saturation else [susceptibility]
    numbers = [susceptibility, saturation, spacing] if spacing else numbers
    return _add_material(spec, "geoms", geoms, numbers, name, "iron", "iron")


@checked
def add_conductor(
    spec: mujoco.MjSpec,
    geoms: Geoms,
    conductivity: NotNegative,
    thickness: NotNegative = 0.0,
    *,
    name: str = "conductor",
) -> mujoco.MjsTuple:
    """Add conducting plates to an `MjSpec`, in which eddy currents brake the magnets above.

    Parameters
    ----------
    spec : mujoco.MjSpec
    geoms : sequence of mujoco.MjsGeom
        Planes: the upper faces of the plates.
    conductivity : float
        In S/m, such as 3.5e7 of aluminum and 5.8e7 of copper.
    thickness : float, default 0.0
        In m; 0 for a plate much thicker than the magnets are above it.
    name : str, default "conductor"
        Name of the tuple and of the numeric, which must start with `conductor` and be one word.

    Returns
    -------
    mujoco.MjsTuple

    Raises
    ------
    ValueError
        An argument is invalid, a geom is not in the spec or has no name, or the name of the
        conductor is taken; also as for `add_magnetism`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> spec = mujoco.MjSpec()
    >>> kind = mujoco.mjtGeom.mjGEOM_PLANE
    >>> floor = spec.worldbody.add_geom(name="floor", type=kind, size=[1, 1, 1])
    >>> print(*mm.add_conductor(spec, [floor], 3.5e7, 0.003).objname)
    conductor floor
    """
    numbers = [conductivity, thickness] if thickness else [conductivity]
    return _add_material(spec, "geoms", geoms, numbers, name, "conductor", "conductors")


@checked
def add_hysteresis(
    spec: mujoco.MjSpec,
    sites: Sites,
    coercivity: Positive,
    remanence: Ratio,
    *,
    name: str = "hysteresis",
) -> mujoco.MjsTuple:
    """Let dipoles of an `MjSpec` follow the field with hysteresis, such as soft rods.

    Parameters
    ----------
    spec : mujoco.MjSpec
    sites : sequence of mujoco.MjsSite
        Sites with a moment, as `add_dipole` returns them, which is that at saturation.
    coercivity : float
        In A/m, such as 12 of the soft rods in small satellites.
    remanence : float
        The remanence over the saturation, between 0 and 1, of the loop of the rod as it is, which
        its own field makes flat.
    name : str, default "hysteresis"
        Name of the tuple and of the numeric, which must start with `hysteresis` and be one word.

    Returns
    -------
    mujoco.MjsTuple

    Raises
    ------
    ValueError
        An argument is invalid, a site is not in the spec or has no name, or the name of the
        hysteresis is taken; also as for `add_magnetism`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> spec = mujoco.MjSpec()
    >>> body = spec.worldbody.add_body()
    >>> rod = mm.add_dipole(spec, body, 1.5e-3, zaxis=[1, 0, 0], name="rod")
    >>> print(*mm.add_hysteresis(spec, [rod], 12, 0.16).objname)
    hysteresis rod
    """
    numbers = [coercivity, remanence]
    return _add_material(spec, "sites", sites, numbers, name, "hysteresis", "hysteresis")


def _add_material(
    spec: mujoco.MjSpec,
    argument: str,
    elements: Sequence[mujoco.MjsGeom | mujoco.MjsSite],
    numbers: list[float],
    name: str,
    start: str,
    word: str,
) -> mujoco.MjsTuple:
    """Add a numeric and a tuple of it and elements, with a name that starts with a word."""
    listed = [_listed(spec, f"{argument}[{k}]", one) for k, one in enumerate(elements)]
    for kind in ("numeric", "tuple"):
        _check_new(spec, kind, name, start)
    spec.add_numeric(name=name, data=numbers, size=len(numbers))
    added = _add_tuple(spec, name, [(NUMERIC, name, 0.0), *listed])
    let_act(spec, word)
    return added


def _add_tuple(spec: mujoco.MjSpec, name: str, listed: Sequence[Listed]) -> mujoco.MjsTuple:
    types, names, numbers = map(list, zip(*listed, strict=True))
    return spec.add_tuple(name=name, objtype=types, objname=names, objprm=numbers)


def _listed(spec: mujoco.MjSpec, argument: str, element: Any, prm: float = 0.0) -> Listed:
    """Return an element for a tuple, and check that it can be listed."""
    _check_owner(spec, argument, element)
    if element.name.split() != [element.name]:
        sentence = "must be one word, since a tuple lists names with spaces between them"
        raise ArgumentError(f"name of {argument}", element.name, sentence)
    return TYPES[type(element)], element.name, prm


def _check_owner(spec: mujoco.MjSpec, argument: str, element: Any) -> None:
    """Check that an element is a part of a spec."""
    top = element
    while getattr(top, "parent", None) is not None:
        top = top.parent
    if top not in (spec.worldbody, *spec.actuators):
        raise ArgumentError(argument, element.name, "must be in the spec, not in another one")


def _check_new(spec: mujoco.MjSpec, kind: str, name: str, word: str = "") -> None:
    """Check that a name starts with a word, if one is given, and is not taken."""
    single = word in ("", "coil") or name.split() == [name]  # tuples do not list coils
    if not (name.startswith(word) and single):
        raise ArgumentError(
            "name", name, f"must start with {word!r}{' and be one word' * (not single)}"
        )
    if name and getattr(spec, kind)(name) is not None:
        raise ArgumentError("name", name, f"must be new, since the spec has a {kind} of this name")


def _numbers_of(field: Any) -> tuple[str, list[float]]:
    """Return the name of a field, `field` unless it is MJCF, and its numbers."""
    name, numbers = "field", field
    if isinstance(field, str):
        try:
            element = ElementTree.fromstring(field)
            name, numbers = element.attrib["name"], [*map(float, element.attrib["data"].split())]
        except (ElementTree.ParseError, KeyError, ValueError):
            sentence = "must be numbers, or MJCF as tabulated_field returns it"
            raise ArgumentError("field", field, sentence) from None
    numbers = check_array("field", numbers, "n").tolist()
    if not are_valid(numbers, thorough=True):
        raise ArgumentError("field", numbers, FIELD_RULE)
    return name, numbers


def _add(body: Place, tag: str, attributes: dict[str, Any]) -> Any:
    """Add an element, of which attributes of MJCF are given, to a body."""
    given = {{"user": "userdata"}.get(key, key): value for key, value in attributes.items()}
    size = given.pop("size")
    if "type" in given:
        given["type"] = getattr(mujoco.mjtGeom, f"mjGEOM_{given['type'].upper()}")
    element = getattr(body, f"add_{tag}")(**given)
    element.size[: len(size)] = size  # the others keep their defaults
    return element
