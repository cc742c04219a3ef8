"""What a model declares: couplings, fields, coils, iron and magnetometers, by name."""

from collections import Counter
from collections.abc import Iterable, Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

import magmotor_plugin
from magmotor.common.arrays import Array
from magmotor.mjcf.forces.fields import GRADIENT, UNIFORM
from magmotor.mjcf.lookup import given_name

NUMERIC, GEOM, SITE, BODY, ACTUATOR = (
    int(getattr(mujoco.mjtObj, f"mjOBJ_{kind}"))
    for kind in ("NUMERIC", "GEOM", "SITE", "BODY", "ACTUATOR")
)

Element = tuple[int, int, float]
"""Type, number and `prm` of an element of a tuple."""


def tuples(model: mujoco.MjModel, prefix: str) -> Iterator[tuple[str, list[Element]]]:
    """Yield the name and the elements of each tuple whose name starts with a prefix."""
    for k in range(model.ntuple):
        name = given_name(model, "tuple", k)
        if name.startswith(prefix):
            own = slice(model.tuple_adr[k], model.tuple_adr[k] + model.tuple_size[k])
            columns = model.tuple_objtype, model.tuple_objid, model.tuple_objprm
            yield name, [*zip(*(column[own].tolist() for column in columns), strict=True)]


def name_of(model: mujoco.MjModel, kind: str, number: int) -> str:
    """Return the name of an element; without one, its kind and number."""
    return given_name(model, kind, number) or f"{kind} {number}"


def with_kind(kind: str, name: str) -> str:
    """Return what `name_of` returns for an element with its kind before it, once."""
    return name if name.startswith(f"{kind} ") else f"{kind} {name}"


def fields(model: mujoco.MjModel) -> dict[str, str]:
    """Return what each applied field is, by the name of its numeric."""
    found = {}
    for k in range(model.nnumeric):
        name = given_name(model, "numeric", k)
        if is_field(model, k):
            size, first = int(model.numeric_size[k]), int(model.numeric_adr[k])
            nodes = model.numeric_data[first : first + 3]
            kind = {UNIFORM: "uniform", GRADIENT: "gradient"}.get(size)
            found[name] = kind or f"table of {' x '.join(f'{n:g}' for n in nodes)} nodes"
    for _, elements in tuples(model, "field"):
        placed = [_place(model, *element) for element in elements if element[0] != NUMERIC]
        for kind, number, _ in elements:
            if kind == NUMERIC and is_field(model, number):
                found[given_name(model, "numeric", number)] += "".join(placed)
    return found


def field_owners(model: mujoco.MjModel) -> dict[int, int]:
    """Return the rigid body to which each applied field is fixed, by the number of its numeric."""
    found = {k: 0 for k in range(model.nnumeric) if is_field(model, k)}
    for _, elements in tuples(model, "field"):
        bodies = [n if kind == BODY else model.site_bodyid[n]
                  for kind, n, _ in elements if kind in (BODY, SITE)]  # fmt: skip
        for kind, number, _ in elements:
            if kind == NUMERIC and bodies:
                found[number] = int(model.body_weldid[bodies[0]])
    return found


def is_field(model: mujoco.MjModel, numeric: int) -> bool:
    """Whether a numeric is an applied field."""
    return given_name(model, "numeric", numeric).startswith("field")


def _place(model: mujoco.MjModel, kind: int, number: int, prm: float) -> str:
    if kind == ACTUATOR:
        return f", driven by {name_of(model, 'actuator', number)}"
    return f", fixed to {name_of(model, 'body' if kind == BODY else 'site', number)}"


def coils(model: mujoco.MjModel) -> dict[str, tuple[str, int]]:
    """Return the actuator and the number of dipoles of each coil, by the name of its tuple."""
    found = {}
    for name, elements in tuples(model, "coil"):
        sites = sites_of(model, elements)
        dipoles = sites & (site_moments(model) != 0)
        actuator = next(number for kind, number, _ in elements if kind == ACTUATOR)
        found[name] = name_of(model, "actuator", actuator), int(dipoles.sum())
    return found


def coil_sites(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Return which sites belong to coils."""
    every = (element for _, elements in tuples(model, "coil") for element in elements)
    return sites_of(model, every)


def sites_of(model: mujoco.MjModel, elements: Iterable[Element]) -> NDArray[np.bool_]:
    """Return which sites are among the elements of tuples, or belong to a body among them."""
    sites = np.zeros(model.nsite, bool)
    for kind, number, _ in elements:
        if kind == SITE:
            sites[number] = True
        elif kind == BODY:
            sites |= model.site_bodyid == number
    return sites


def pushing(model: mujoco.MjModel, prefixes: tuple[str, ...]) -> list[str]:
    """Return the actuators in tuples of coils or fields that also push, by their gain or bias."""
    driving = (
        number
        for prefix in prefixes
        for _, elements in tuples(model, prefix)
        for kind, number, _ in elements
        if kind == ACTUATOR
    )
    return [name_of(model, "actuator", number) for number in {*driving} if _pushes(model, number)]


def _pushes(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator can push a body: it has a gain or a bias, and is not at a fixed site."""
    gain, bias = int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])
    computed = gain > int(mujoco.mjtGain.mjGAIN_AFFINE) or bias > int(mujoco.mjtBias.mjBIAS_AFFINE)
    biased = bias != int(mujoco.mjtBias.mjBIAS_NONE) and model.actuator_biasprm[actuator, :3].any()
    sites = [site for site in model.actuator_trnid[actuator].tolist() if site >= 0]
    at_sites = model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_SITE
    fixed = at_sites and not model.body_weldid[model.site_bodyid[sites]].any()
    return not fixed and bool(computed or biased or model.actuator_gainprm[actuator, :3].any())


def magnetometers(model: mujoco.MjModel) -> dict[str, str]:
    """Return the site of each magnetometer, by the name of the sensor."""
    slot = magmotor_plugin.slot(magmotor_plugin.MAGNETOMETER)
    return {
        name_of(model, "sensor", k): name_of(model, "site", int(model.sensor_objid[k]))
        for k, instance in enumerate(model.sensor_plugin.tolist())
        if instance >= 0 and model.plugin[instance] == slot
    }


def iron(model: mujoco.MjModel) -> dict[int, float]:
    """Return the susceptibilities of the geoms that are iron, by their numbers."""
    found = {}
    for _, elements in tuples(model, "iron"):
        material = next(number for kind, number, _ in elements if kind == NUMERIC)
        susceptibility = float(model.numeric_data[model.numeric_adr[material]])
        found |= {number: susceptibility for kind, number, _ in elements if kind == GEOM}
    return found


def has_plugin(model: mujoco.MjModel) -> bool:
    """Whether a model has the plugin that applies the forces."""
    return bool((model.plugin == magmotor_plugin.register()).any())


def site_moments(model: mujoco.MjModel) -> Array:
    """Return the first user number of each site, zero where there is none."""
    return model.site_user[:, 0] if model.nuser_site else np.zeros(model.nsite)


def dipole_counts(model: mujoco.MjModel) -> dict[int, int]:
    """Return the number of dipoles by body."""
    sites = np.flatnonzero(site_moments(model))
    return dict(sorted(Counter(model.site_bodyid[sites].tolist()).items()))


def can_move(model: mujoco.MjModel, body: int) -> bool:
    """Whether the rigid body to which a body belongs has joints."""
    return bool(model.body_dofnum[model.body_weldid[body]])
