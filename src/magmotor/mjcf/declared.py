"""What a model declares, by name: the rows of its table, for descriptions and checks."""

import ctypes
from collections import Counter
from functools import cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf import layout
from magmotor.mjcf.declarations import reader
from magmotor.mjcf.declarations import table as of_table
from magmotor.mjcf.declarations.custom import BODY
from magmotor.mjcf.declarations.fields import GRADIENT, UNIFORM
from magmotor.mjcf.declarations.table import HEADER, SECTIONS, STARTS, WORDS_OF_HEADER
from magmotor.mjcf.lookup import given_name


@cache
def _table_of() -> Any:
    """Return the reader as a C function of the address of a model."""
    reader.bind_others()
    kind = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_bool)
    return kind(reader.compiled(layout.current()).address)


def rows(model: mujoco.MjModel, section: int) -> Any:
    """Return the records of a section of a model's table; see `declarations/table.py`."""
    address = _table_of()(model._address, True)
    first, end = _words(address, WORDS_OF_HEADER)[STARTS + section : STARTS + section + 2]
    words = _words(address + 8 * int(first), int(end - first))
    return words.view(SECTIONS[section]).view(np.recarray)


def header(model: mujoco.MjModel) -> Any:
    """Return the header of a model's table, a record."""
    return _words(_table_of()(model._address, True), STARTS).view(HEADER).view(np.recarray)[0]


def _words(address: int, count: int) -> NDArray[np.int64]:
    """Return a copy of words in memory that is never freed."""
    return np.array((ctypes.c_int64 * count).from_address(address), np.int64)


def name_of(model: mujoco.MjModel, kind: str, number: int) -> str:
    """Return the name of an element; without one, its kind and number."""
    return given_name(model, kind, number) or f"{kind} {number}"


def with_kind(kind: str, name: str) -> str:
    """Return what `name_of` returns for an element with its kind before it, once."""
    return name if name.startswith(f"{kind} ") else f"{kind} {name}"


def fields(model: mujoco.MjModel) -> dict[str, str]:
    """Return what each applied field is, by the name of its numeric."""
    found = {}
    for row in rows(model, of_table.FIELDS):
        numeric, kind = row.numeric, row.frame_type
        size, first = int(model.numeric_size[numeric]), int(model.numeric_adr[numeric])
        nodes = " x ".join(f"{n:g}" for n in model.numeric_data[first : first + 3])
        what = {UNIFORM: "uniform", GRADIENT: "gradient"}.get(size, f"table of {nodes} nodes")
        if kind:
            frame = name_of(model, "body" if kind == BODY else "site", row.frame)
            what += f", fixed to {frame}"
        if row.actuator >= 0:
            what += f", driven by {name_of(model, 'actuator', row.actuator)}"
        found[given_name(model, "numeric", numeric)] = what
    return found


def field_owners(model: mujoco.MjModel) -> set[int]:
    """Return the rigid bodies to which applied fields are fixed."""
    return {*rows(model, of_table.FIELDS).weld.tolist()}


def coils(model: mujoco.MjModel) -> dict[str, tuple[str, int]]:
    """Return the actuator and the number of magnets of each coil, by the name of its tuple."""
    found, of_site, of_geom = {}, coil_of_sites(model), coil_of_geoms(model)
    for coil, row in enumerate(rows(model, of_table.COILS)):
        dipoles = (of_site == coil) & (site_moments(model) != 0)
        actuator = name_of(model, "actuator", row.actuator)
        count = int(dipoles.sum() + (of_geom == coil).sum())
        found[given_name(model, "tuple", row.tuple)] = actuator, count
    return found


def coil_of_sites(model: mujoco.MjModel) -> NDArray[np.int64]:
    """Return the row of the coil to which each site belongs, or -1."""
    found = rows(model, of_table.SITES).coil
    return found if len(found) else np.full(model.nsite, -1)


def coil_of_geoms(model: mujoco.MjModel) -> NDArray[np.int64]:
    """Return the row of the coil to which each geom belongs, or -1."""
    found, shapes = np.full(model.ngeom, -1), rows(model, of_table.SHAPES)
    found[shapes.geom] = shapes.coil
    return found


def drivers(model: mujoco.MjModel, section: int) -> list[int]:
    """Return the actuators of coils or of fields."""
    found = rows(model, section).actuator
    return [*dict.fromkeys(found[found >= 0].tolist())]


def pushing(model: mujoco.MjModel, actuators: list[int]) -> list[str]:
    """Return which actuators of coils or fields also push, by their gain or bias."""
    return [name_of(model, "actuator", number) for number in actuators if _pushes(model, number)]


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
    return {
        name_of(model, "sensor", row.sensor): name_of(model, "site", row.site)
        for row in rows(model, of_table.MAGNETOMETERS)
    }


def iron(model: mujoco.MjModel) -> dict[int, float]:
    """Return the susceptibilities of the geoms that are iron, by their numbers."""
    found = [*rows(model, of_table.PIECES), *rows(model, of_table.PLANES)]
    return {
        int(row.geom): float(model.numeric_data[model.numeric_adr[row.material]]) for row in found
    }


def conductors(model: mujoco.MjModel) -> dict[int, tuple[float, float]]:
    """Return the conductivity and the thickness of each plate, by the number of its plane."""
    found = {}
    for row in rows(model, of_table.CONDUCTORS):
        first, count = model.numeric_adr[row.numeric], model.numeric_size[row.numeric]
        numbers = [*model.numeric_data[first : first + count].tolist(), 0.0]
        found[int(row.geom)] = numbers[0], numbers[1]
    return found


def hysteresis(model: mujoco.MjModel) -> dict[int, tuple[float, float]]:
    """Return the coercivity and the remanence over the saturation of each site with hysteresis."""
    found = {}
    for row in rows(model, of_table.MEMORIES):
        first = model.numeric_adr[row.numeric]
        coercivity, remanence = model.numeric_data[first : first + 2].tolist()
        found[int(row.site)] = coercivity, remanence
    return found


def polarizations(model: mujoco.MjModel) -> dict[int, Array]:
    """Return the polarizations in T of the geoms that are magnets, in their frames."""
    found = rows(model, of_table.SHAPES).geom.tolist()
    return {geom: model.geom_user[geom, :3] for geom in found if model.geom_user[geom, :3].any()}


def couplings(model: mujoco.MjModel) -> dict[frozenset[int], float]:
    """Return the factors of couplings, by their two bodies."""
    factors: dict[frozenset[int], float] = {}
    for row in rows(model, of_table.COUPLINGS):
        pair = frozenset({int(row.body), int(row.other)})
        factors[pair] = factors.get(pair, 1.0) * float(model.tuple_objprm[row.element])
    return factors


def has_plugin(model: mujoco.MjModel) -> bool:
    """Whether a model has the plugin that applies the forces."""
    return bool(header(model).instance >= 0)


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
