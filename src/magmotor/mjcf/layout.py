"""Offsets of fields in MuJoCo's C structs.

The offsets come from the declarations that MuJoCo ships (`mujoco.introspect`). Before use, they are
verified against the addresses of the NumPy views of a small model.
"""

import ctypes
from collections import namedtuple
from functools import cache

import mujoco
import numpy as np
from mujoco.introspect import ast_nodes
from mujoco.introspect.structs import STRUCTS

from magmotor.common.exceptions import MagmotorError
from magmotor.numerics.constants import ConstantInCode
from magmotor_plugin import slots

MODEL_FIELDS = (
    "nq", "nv", "nactuator", "nbody", "nbuffer", "njnt", "nsite", "ntuple", "nuser_body",
    "nuser_jnt",
    "nuser_site", "nuserdata", "body_weldid", "body_dofnum", "body_user", "jnt_type", "jnt_bodyid",
    "jnt_qposadr", "jnt_dofadr", "jnt_user", "site_bodyid", "site_user", "tuple_adr",
    "tuple_size", "tuple_objtype", "tuple_objid", "tuple_objprm", "ntext", "text_adr",
    "text_data", "name_tupleadr", "name_textadr",
    "names", "nplugin", "plugin", "plugin_attr", "plugin_attradr",
    "ngeom", "geom_type", "geom_bodyid", "geom_size", "nnumeric", "numeric_adr", "numeric_size",
    "numeric_data", "actuator_actnum", "actuator_actadr", "actuator_ctrladr", "actuator_ctrlnum",
    "actuator_ctrllimited", "actuator_ctrlrange", "actuator_delay", "nsensor",
    "sensor_objtype", "sensor_plugin", "sensor_adr", "sensor_dim", "sensor_objid", "nsensordata",
    "name_numericadr", "body_invweight0", "body_geomnum", "body_geomadr",
    "body_rootid", "geom_rbound", "body_mass", "body_inertia", "geom_aabb",
    "nu", "na", "nnames", "nnumericdata", "ntextdata", "ntupledata", "npluginattr",
    "body_parentid", "name_bodyadr", "name_jntadr", "name_geomadr", "name_siteadr",
    "name_actuatoradr", "name_sensoradr", "nuser_geom", "geom_user", "geom_dataid",
    "nmesh", "nmeshvert", "mesh_vertadr", "mesh_vertnum", "mesh_vert", "mesh_faceadr",
    "mesh_facenum", "mesh_face", "nmeshface", "mesh_quat", "geom_pos", "geom_quat", "body_pos",
    "body_quat", "npluginstate", "plugin_stateadr", "plugin_statenum",
)  # fmt: skip
OPTION_FIELDS = ("timestep", "integrator", "disableflags", "enableflags")
DATA_FIELDS = (
    "site_xpos", "site_xmat", "xmat", "xipos", "xfrc_applied", "qfrc_applied", "qpos",
    "qvel", "qfrc_passive", "userdata", "time", "pstack", "pbase",
    "body_awake", "plugin_data", "M", "qLD", "cdof", "subtree_com", "geom_xpos", "ten_J",
    "actuator_moment", "moment_rownnz", "moment_rowadr", "moment_colind", "qfrc_actuator",
    "nefc", "efc_J", "efc_pos", "efc_margin", "efc_KBIP", "efc_D", "geom_xmat", "xpos", "ctrl",
    "act", "sensordata", "cvel", "ximat", "ncon", "qacc", "qacc_smooth",
    "qacc_warmstart", "plugin_state", "contact",
)  # fmt: skip
CONTACT_FIELDS = ("contact_size", "contact_dist", "contact_geom")
NOTES = 500
"""Length of `notes`: 64-bit words of an mjData that MuJoCo copies and resets, and rarely writes.

They are the end of the solver's statistics: those of a 20th island after its first 100 iterations,
which are all unless the model asks for more.
"""

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
  <extension>
    <plugin plugin="magmotor.forces">
      <instance name="probe"><config key="act" value="all"/></instance>
    </plugin>
  </extension>
  <option timestep="0.0625" integrator="implicitfast">
    <flag gravity="disable" energy="enable"/>
  </option>
  <size nuserdata="17" nuser_body="11" nuser_jnt="13" nuser_geom="7"/>
  <asset><mesh name="pyramid" vertex="0 0 0 1 0 0 0 1 0 1 1 0 .3 .4 1"/></asset>
  <custom>
    <numeric name="first" data="1 2"/>
    <numeric name="last" data="3"/>
    <text name="probe" data="some words"/>
    <text name="second" data="more"/>
    <text name="third" data="more"/>
    <tuple name="pair">
      <element objtype="body" objname="world" prm="2"/>
      <element objtype="site" objname="fixed" prm="3"/>
    </tuple>
  </custom>
  <worldbody>
    <site name="fixed" user="2"/>
    <geom size="1" pos="0 0 1.5"/>
    <geom size="1" pos="0 0 9"/>
    <body>
      <freejoint/>
      <geom size="1"/>
      <site name="moving" pos="0 0 1" user="3"/>
      <body>
        <joint name="limited" type="hinge" range="57 58"/>
        <geom size="1"/>
      </body>
    </body>
  </worldbody>
  <tendon><fixed><joint joint="limited" coef="1"/></fixed></tendon>
  <actuator>
    <general joint="limited" dyntype="filter" ctrlrange="-1 1"/>
    <motor joint="limited"/>
  </actuator>
  <sensor><clock/></sensor>
</mujoco>
"""
_PROBE_PSTACK = 0x5A5A40
"""Conspicuous value of `pstack` while its offset is verified."""


UNSUPPORTED = 'this version is not supported; 3.11 to 4.0 are: pip install "mujoco==4.0.*"'


class LayoutError(MagmotorError, RuntimeError):
    """The layout of MuJoCo's structs differs from MuJoCo's own declarations."""


class Layout(
    ConstantInCode,
    namedtuple(
        "Layout",
        (*MODEL_FIELDS, *OPTION_FIELDS, *DATA_FIELDS, *CONTACT_FIELDS, "notes", "forwards"),
    ),
):
    """Byte offsets of fields in mjModel, including its options, in mjData, and in a contact.

    `contact_size` is the size of a contact in bytes. `notes` are `NOTES` words of mjData, and
    `forwards` is how often `mj_forward` has ended, also within `mj_step`, an integer.
    """


@cache
def current() -> Layout:
    """Return the verified offsets for the running MuJoCo.

    Raises
    ------
    LayoutError
        Declarations are missing or differ from the running library.
    """
    try:
        model, option, data = map(_structure, ("mjModel", "mjOption", "mjData"))
        offsets = {name: getattr(model, name).offset for name in MODEL_FIELDS}
        start = getattr(model, "opt").offset  # noqa: B009 - pyright knows no such attribute
        offsets |= {name: start + getattr(option, name).offset for name in OPTION_FIELDS}
        offsets |= {name: getattr(data, name).offset for name in DATA_FIELDS}
        contact = _structure("mjContact")
        offsets |= {f"contact_{name}": getattr(contact, name).offset for name in ("dist", "geom")}
        offsets["contact_size"] = ctypes.sizeof(contact)
        statistics = getattr(data, "solver")  # noqa: B009
        timers, timer = getattr(data, "timer"), _structure("mjTimerStat")  # noqa: B009
        forward = int(mujoco.mjtTimer.mjTIMER_FORWARD) * ctypes.sizeof(timer)
        number = getattr(timer, "number").offset  # noqa: B009
        offsets["forwards"] = timers.offset + forward + number
        offsets["notes"] = statistics.offset + statistics.size - 8 * NOTES
    except (KeyError, AttributeError) as missing:
        name = getattr(missing, "name", None) or missing
        raise LayoutError(
            f"MuJoCo {mujoco.__version__} does not declare {name}: {UNSUPPORTED}"
        ) from missing
    layout = Layout(**offsets)
    verify(layout)
    return layout


def verify(layout: Layout) -> None:
    """Read a probe model through `layout`, and compare with MuJoCo's NumPy views.

    Raises
    ------
    LayoutError
        Offsets are wrong. The message names the fields.
    """
    if mujoco.MjModel.from_xml_string("<mujoco/>").qpos0.dtype != np.float64:
        raise LayoutError("MuJoCo was built in single precision, but double precision is required")
    slots.register()
    with slots.without_code():
        model = mujoco.MjModel.from_xml_string(_PROBE)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
    data.time, data.pstack, data.pbase = 0.375, _PROBE_PSTACK, _PROBE_PSTACK + 64
    data.solver[len(data.solver) - 1].nupdate = _PROBE_PSTACK
    data.timer[mujoco.mjtTimer.mjTIMER_FORWARD].number = _PROBE_PSTACK
    wrong = []
    owners = ((MODEL_FIELDS, model, model), (OPTION_FIELDS, model, model.opt))
    for fields, struct, owner in (*owners, (DATA_FIELDS[:-1], data, data)):
        for name in fields:
            address = struct._address + getattr(layout, name)
            expected = getattr(owner, name)
            if isinstance(expected, bytes):
                # Follow this pointer only if all offsets before it are right.
                agrees = not wrong and (
                    ctypes.string_at(_read(ctypes.c_void_p, address) or 0, len(expected))
                    == expected
                )
            elif isinstance(expected, np.ndarray):
                agrees = _read(ctypes.c_void_p, address) == expected.ctypes.data
            elif isinstance(expected, float):
                agrees = _read(ctypes.c_double, address) == expected
            else:
                short = fields is OPTION_FIELDS or name in ("nefc", "ncon")
                kind = ctypes.c_int if short else ctypes.c_int64
                agrees = _read(kind, address) == expected
            if not agrees:
                wrong.append(name)
    data.pstack = data.pbase = 0
    first = _read(ctypes.c_void_p, data._address + layout.contact) or 0
    views = {"contact_dist": data.contact.dist, "contact_geom": data.contact.geom}
    moved = [name for name in views if views[name].ctypes.data != first + getattr(layout, name)]
    wrong += ["contact"] if len(moved) == len(views) else moved
    last = _read(ctypes.c_int, data._address + layout.notes + 8 * NOTES - 4)
    wrong += ["notes"] * (last != _PROBE_PSTACK)
    forwards = _read(ctypes.c_int, data._address + layout.forwards)
    wrong += ["forwards"] * (forwards != _PROBE_PSTACK)
    wrong += ["contact_size"] * (data.contact.dist.strides[0] != layout.contact_size)
    if wrong:
        raise LayoutError(
            f"MuJoCo {mujoco.__version__} does not keep {', '.join(wrong)} at the declared offsets:"
            f" {UNSUPPORTED}"
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
