"""Names of the elements of a compiled model, its disabled features, and a checksum of them."""

import zlib
from contextlib import suppress
from typing import Any

import mujoco
import numpy as np

from magmotor_plugin import slots

INTEGRATORS = {
    {"EULER": "Euler", "RK4": "RK4"}.get(name := member.removeprefix("mjINT_"), name.lower()): kind
    for member, kind in mujoco.mjtIntegrator.__members__.items()
}
"""The integrators of this version of MuJoCo, by their names in MJCF."""


def disabled(model: mujoco.MjModel, flag: str) -> bool:
    """Whether a feature is disabled, by its own flag or by the flag for all constraints."""
    flags = {flag}
    if flag in {"equality", "frictionloss", "limit", "contact"}:
        flags.add("constraint")
    bits = (getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}") for name in flags)
    return any(model.opt.disableflags & bit for bit in bits)


def label(model: mujoco.MjModel, kind: str, number: Any) -> str:
    """Return the name of an element for a message, such as "body 'ball'", or its number."""
    if name := given_name(model, kind, number):
        return f"{kind} {name!r}"
    owner = int(model.geom_bodyid[number]) if kind == "geom" else 0
    body = given_name(model, "body", owner) if owner else ""  # the world is no owner
    return f"{kind} {number} of body {body!r}" if body else f"{kind} {number}"


def given_name(model: mujoco.MjModel, kind: str, number: Any) -> str:
    """Return the name of an element; "" without one."""
    try:
        return mujoco.mj_id2name(model, _object_type(kind), int(number)) or ""
    except UnicodeDecodeError as error:
        return decoded(error.object)


def decoded(characters: bytes) -> str:
    """Return what MuJoCo has read from a file as text; what is not UTF-8 is taken for Latin-1."""
    try:
        return characters.decode()
    except UnicodeDecodeError:
        return characters.decode("latin-1")


def number_of(model: mujoco.MjModel, kind: str, name: str) -> int:
    """Return the number of a named element; -1 if there is none."""
    for encoding in ("utf-8", "latin-1"):
        with suppress(UnicodeEncodeError):
            characters: Any = name.encode(encoding)
            if (number := mujoco.mj_name2id(model, _object_type(kind), characters)) >= 0:
                return number
    return -1


def control_of(model: mujoco.MjModel, actuator: int) -> int:
    """Return the number of an actuator's first control, which is its own before MuJoCo 4."""
    addresses = getattr(model, "actuator_ctrladr", range(model.nu))
    return int(addresses[actuator])


def foreign_plugins(model: mujoco.MjModel) -> int:
    """Return the number of instances of plugins that are not this package's."""
    ours = [slots.slot(name) for name in slots.NAMES]
    return int((~np.isin(model.plugin, ours)).sum())


def _object_type(kind: str) -> int:
    return getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")


def potential_checksum(model: mujoco.MjModel) -> int:
    """Return a checksum of a model's flags and soft constraints, which change its potential."""
    ours = mujoco.mjtDisableBit.mjDSBL_REFSAFE | mujoco.mjtDisableBit.mjDSBL_AUTORESET
    kinds = ("jnt_solref", "jnt_solimp", "tendon_solref_lim", "tendon_solimp_lim", "eq_solref",
             "eq_solimp", "geom_solref", "geom_solimp", "pair_solref", "pair_solimp")  # fmt: skip
    numbers = [np.array([model.opt.disableflags & ~int(ours)], float)]
    numbers += [getattr(model, kind).ravel() for kind in kinds]
    return zlib.crc32(np.concatenate(numbers).tobytes())
