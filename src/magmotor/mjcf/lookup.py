"""What a compiled model calls its parts, and which features it has switched off."""

from typing import Any

import mujoco


def disabled(model: mujoco.MjModel, flag: str) -> bool:
    """Whether a feature is switched off, by its own flag or by that of all constraints."""
    flags = {flag}
    if flag in {"equality", "frictionloss", "limit", "contact"}:
        flags.add("constraint")
    bits = (getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}") for name in flags)
    return any(model.opt.disableflags & bit for bit in bits)


def label(model: mujoco.MjModel, kind: str, number: Any) -> str:
    """How to name a part in a message."""
    name = mujoco.mj_id2name(model, _object_type(kind), int(number))
    return f"{kind} {name!r}" if name else f"{kind} {number}"


def number_of(model: mujoco.MjModel, kind: str, name: str) -> int:
    """The number of a part with a name; -1 if there is none."""
    return mujoco.mj_name2id(model, _object_type(kind), name)


def _object_type(kind: str) -> int:
    return getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
