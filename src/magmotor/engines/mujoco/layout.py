"""Where the fields that the callback reads lie inside MuJoCo's C structs.

The offsets come from the declarations that MuJoCo ships (`mujoco.introspect`) and are checked
against the addresses of the NumPy views of a small model before anything is read through them.
"""

import ctypes
from functools import cache
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco.introspect import ast_nodes
from mujoco.introspect.structs import STRUCTS

MODEL_FIELDS = (
    "nsite", "nuser_site", "body_weldid", "body_dofnum", "site_bodyid", "site_user",
    "name_siteadr", "names",
)  # fmt: skip
DATA_FIELDS = ("site_xpos", "site_xmat", "xipos", "xfrc_applied")

_SCALARS = {
    "int": ctypes.c_int,
    "float": ctypes.c_float,
    "mjtNum": ctypes.c_double,
    "mjtBool": ctypes.c_bool,
    "mjtByte": ctypes.c_ubyte,
    "mjtSize": ctypes.c_int64,
    "size_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
    "uintptr_t": ctypes.c_void_p,
}

_PROBE = """
<mujoco>
  <worldbody>
    <site name="fixed" user="2"/>
    <body>
      <freejoint/>
      <geom size="1"/>
      <site name="moving" pos="0 0 1" user="3"/>
    </body>
  </worldbody>
</mujoco>
"""


class LayoutError(RuntimeError):
    """MuJoCo's structs are not laid out as its own declarations say."""


class Layout(NamedTuple):
    """Byte offsets in mjModel and mjData, by field."""

    nsite: int
    nuser_site: int
    body_weldid: int
    body_dofnum: int
    site_bodyid: int
    site_user: int
    names: int
    name_siteadr: int
    site_xpos: int
    site_xmat: int
    xipos: int
    xfrc_applied: int


@cache
def current() -> Layout:
    """Offsets for the MuJoCo that is running, verified.

    Raises
    ------
    LayoutError
        The declarations are missing or disagree with the running library.
    """
    try:
        model, data = _structure("mjModel"), _structure("mjData")
        offsets = {name: getattr(model, name).offset for name in MODEL_FIELDS}
        offsets |= {name: getattr(data, name).offset for name in DATA_FIELDS}
    except (KeyError, AttributeError) as missing:
        raise LayoutError(
            f"MuJoCo {mujoco.__version__} declares no {missing}: this version is not supported"
        ) from missing
    layout = Layout(**offsets)
    verify(layout)
    return layout


def verify(layout: Layout) -> None:
    """Read a probe model through `layout` and compare with MuJoCo's own NumPy views.

    Raises
    ------
    LayoutError
        Names the fields that disagree.
    """
    if mujoco.MjModel.from_xml_string("<mujoco/>").qpos0.dtype != np.float64:
        raise LayoutError("MuJoCo was built in single precision: double is needed")
    model = mujoco.MjModel.from_xml_string(_PROBE)
    data = mujoco.MjData(model)
    wrong = []
    for fields, owner in ((MODEL_FIELDS, model), (DATA_FIELDS, data)):
        for name in fields:
            place = owner._address + getattr(layout, name)
            expected = getattr(owner, name)
            if isinstance(expected, np.ndarray):
                agrees = _read(ctypes.c_void_p, place) == expected.ctypes.data
            elif isinstance(expected, bytes):
                # A pointer is followed only once all before it have proved right.
                agrees = not wrong and (
                    ctypes.string_at(_read(ctypes.c_void_p, place) or 0, len(expected)) == expected
                )
            else:
                agrees = _read(ctypes.c_int64, place) == expected
            if not agrees:
                wrong.append(name)
    if wrong:
        raise LayoutError(
            f"MuJoCo {mujoco.__version__} does not keep {', '.join(wrong)} where its declarations"
            " say: this version is not supported"
        )


def _read(kind, address):
    return kind.from_address(address).value


@cache
def _structure(name: str) -> type[ctypes.Structure]:
    declaration = STRUCTS[name]
    return type(name, (ctypes.Structure,), {"_fields_": _fields(declaration.fields)})


def _fields(declarations):
    return [
        (f"{declaration.name}", _ctype(getattr(declaration, "type", declaration)))
        for declaration in declarations
    ]


def _ctype(kind):
    match kind:
        case ast_nodes.PointerType():
            return ctypes.c_void_p
        case ast_nodes.ArrayType():
            inner = _ctype(kind.inner_type)
            for extent in reversed(kind.extents):
                inner = inner * extent
            return inner
        case ast_nodes.AnonymousStructDecl():
            return type("anonymous", (ctypes.Structure,), {"_fields_": _fields(kind.fields)})
    return _SCALARS.get(kind.name) or (
        ctypes.c_int if kind.name.startswith("mjt") else _structure(kind.name)
    )
