"""Whether the indices, ranges and texts that are read from a model lie within its arrays.

MuJoCo's check of a binary model lets -1 pass, and sums that overflow. It does not check what Python
assigns to a model. Here, they are checked where a model's structure is first read.
"""

import numpy as np

from magmotor.mjcf import layout, memory
from magmotor.mjcf.declarations.custom import (
    ACTUATOR,
    BODY,
    GEOM,
    JOINT,
    NUMERIC,
    SENSOR,
    SITE,
    TUPLE,
)
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import External, subroutine

ANY, PRECEDING_OR_OWN, PRECEDING, APART = range(4)
"""Which elements an index may name; a tree is sorted, so that no loop over parents is endless.

Ranges that are `APART` follow one another, so that together they are no longer than their array.
"""

INDICES = (
    ("name_textadr", "ntext", "nnames", "", ANY),
    ("text_adr", "ntext", "ntextdata", "", ANY),
    ("plugin_attradr", "nplugin", "npluginattr", "", ANY),
    ("plugin_stateadr", "nplugin", "npluginstate", "plugin_statenum", ANY),
    ("name_numericadr", "nnumeric", "nnames", "", ANY),
    ("numeric_adr", "nnumeric", "nnumericdata", "numeric_size", ANY),
    ("name_tupleadr", "ntuple", "nnames", "", ANY),
    ("tuple_adr", "ntuple", "ntupledata", "tuple_size", APART),
    ("body_parentid", "nbody", "nbody", "", PRECEDING),
    ("body_rootid", "nbody", "nbody", "", PRECEDING_OR_OWN),
    ("body_weldid", "nbody", "nbody", "", PRECEDING_OR_OWN),
    ("body_geomadr", "nbody", "ngeom", "body_geomnum", ANY),
    ("name_bodyadr", "nbody", "nnames", "", ANY),
    ("jnt_bodyid", "njnt", "nbody", "", ANY),
    ("jnt_qposadr", "njnt", "nq", "", ANY),
    ("jnt_dofadr", "njnt", "nv", "", ANY),
    ("name_jntadr", "njnt", "nnames", "", ANY),
    ("geom_bodyid", "ngeom", "nbody", "", ANY),
    ("name_geomadr", "ngeom", "nnames", "", ANY),
    ("site_bodyid", "nsite", "nbody", "", ANY),
    ("name_siteadr", "nsite", "nnames", "", ANY),
    ("actuator_ctrladr", "nactuator", "nu", "actuator_ctrlnum", ANY),
    ("actuator_actadr", "nactuator", "na", "actuator_actnum", ANY),
    ("name_actuatoradr", "nactuator", "nnames", "", ANY),
    ("name_sensoradr", "nsensor", "nnames", "", ANY),
    ("sensor_adr", "nsensor", "nsensordata", "sensor_dim", ANY),
    ("mesh_vertadr", "nmesh", "nmeshvert", "mesh_vertnum", ANY),
    ("mesh_faceadr", "nmesh", "nmeshface", "mesh_facenum", ANY),
)
"""Indices, how many there are, into how many elements, and, of a range, the sizes; and the order.

The index of an empty range is not read.
"""

TEXTS = (("names", "nnames"), ("text_data", "ntextdata"), ("plugin_attr", "npluginattr"))
"""Characters, which must end with a zero, and their number."""

OBJECTS = {
    BODY: "nbody",
    JOINT: "njnt",
    GEOM: "ngeom",
    SITE: "nsite",
    ACTUATOR: "nactuator",
    SENSOR: "nsensor",
    NUMERIC: "nnumeric",
    TUPLE: "ntuple",
}
"""The number of elements of each type that a tuple or a sensor may name."""

DATA = {MESH: "nmesh"}
"""The number of meshes, which a geom of that type names; other types name nothing that is read."""

NAMED = (
    ("tuple_objid", "ntupledata", "tuple_objtype", OBJECTS),
    ("sensor_objid", "nsensor", "sensor_objtype", OBJECTS),
    ("geom_dataid", "ngeom", "geom_type", DATA),
)
"""Numbers of elements, how many there are, their types, and how many there are of each type."""

VERTICES = "mesh_face"
"""The vertices of faces, each one of its mesh."""

FIELDS = (*(row[0] for row in (*INDICES, *NAMED)), VERTICES, *(row[0] for row in TEXTS))
"""The fields, of which `invalid_index` returns the number."""

SIZES = {row[0]: row[3] for row in INDICES if row[3]}
"""The sizes of the ranges that begin at an index."""

APART_FIELDS = tuple(row[0] for row in INDICES if row[4] == APART)
"""The indices of ranges that follow one another."""

_word = types.int64
_FIND = types.int64(_word, _word)

invalid_index = External("magmotor_invalid_index", _FIND)
"""Return the number of the first invalid field, or -1.

The arguments are the address of mjModel, and of four words. These receive the element, its value,
the size of its range, and the number of elements that it may name.
"""


def bind() -> None:
    """Bind `invalid_index` to its symbol."""
    memory.bind_compiled("magmotor_invalid_index", _invalid_index(layout.current()))


@compiled_once(_FIND, error_model="numpy")
def _invalid_index(checksum: int, offsets: layout.Layout):
    """Define `invalid_index` for one layout of the structs."""

    def place(name):
        """Return the place of a field in the layout, which a library does not know yet."""
        return layout.Layout._fields.index(name) if name else -1

    indices = np.array([[*map(place, row[:4]), row[4]] for row in INDICES])
    texts = np.array([[*map(place, row)] for row in TEXTS])
    objects = np.full((len(NAMED), max(MESH, *OBJECTS) + 1), -1)
    for k, row in enumerate(NAMED):
        for kind, count in row[3].items():
            objects[k, kind] = place(count)
    named = np.array([[*map(place, row[:3])] for row in NAMED])

    def invalid_index(model, room):
        _ = checksum
        m, found = memory.words(model, memory.UNBOUNDED), memory.words(room, 4)
        for k in range(len(indices)):
            array = _word_at(indices[k, 0], m, offsets)
            count = _word_at(indices[k, 1], m, offsets)
            limit = _word_at(indices[k, 2], m, offsets)
            sizes = _word_at(indices[k, 3], m, offsets) if indices[k, 3] >= 0 else 0
            if _find(array, count, limit, sizes, indices[k, 4], found):
                return k
        for k in range(len(named)):
            array = _word_at(named[k, 0], m, offsets)
            count = _word_at(named[k, 1], m, offsets)
            types_of = _word_at(named[k, 2], m, offsets)
            if _find_object(array, count, types_of, objects[k], m, offsets, found):
                return len(indices) + k
        if _find_vertex(m, offsets, found):
            return len(indices) + len(named)
        for k in range(len(texts)):
            characters = _word_at(texts[k, 0], m, offsets)
            length = _word_at(texts[k, 1], m, offsets)
            if length > 0 and memory.bytes_at(characters, length)[length - 1] != 0:
                found[0] = length - 1
                return len(indices) + len(named) + 1 + k
        return -1

    return invalid_index


@subroutine(forceinline=True)
def _word_at(place, m, offsets):
    """Return the field of a model at a place in the layout."""
    return m[offsets[place] // 8]


@subroutine
def _find(array, count, limit, sizes, order, found):
    """Whether an index is invalid; write the first such element as `invalid_index` does.

    A negative C int is a large number here.
    """
    index, size = memory.integers(array, count), memory.integers(sizes, count)
    end = np.int64(0)
    for i in range(count):
        extent = np.int64(size[i]) if sizes != 0 else 1
        if order == PRECEDING_OR_OWN or (order == PRECEDING and i == 0):
            limit = i + 1
        elif order == PRECEDING:
            limit = i
        if extent > 0 and (np.int64(index[i]) + extent > limit or np.int64(index[i]) < end):
            found[0], found[1], found[2], found[3] = i, index[i], extent, limit
            return True
        if order == APART and extent > 0:
            end = np.int64(index[i]) + extent
    return False


@subroutine
def _find_object(array, count, types_of, objects, m, offsets, found):
    """Whether an element that is named does not exist; write the first such one."""
    index, kind = memory.integers(array, count), memory.integers(types_of, count)
    for i in range(count):
        which = objects[kind[i]] if kind[i] < len(objects) else -1
        if which >= 0 and np.int64(index[i]) >= _word_at(which, m, offsets):
            found[0], found[1], found[2], found[3] = i, index[i], 1, _word_at(which, m, offsets)
            return True
    return False


@subroutine
def _find_vertex(m, offsets, found):
    """Whether a face has a vertex that its mesh lacks; write the first such one.

    Faces are read if geoms may be magnets.
    """
    nmesh = m[offsets.nmesh // 8] if m[offsets.nuser_geom // 8] >= 3 else 0
    first = memory.integers(m[offsets.mesh_faceadr // 8], nmesh)
    faces = memory.integers(m[offsets.mesh_facenum // 8], nmesh)
    vertices = memory.integers(m[offsets.mesh_vertnum // 8], nmesh)
    for mesh in range(nmesh):
        start = 3 * np.int64(first[mesh])
        index = memory.integers(m[offsets.mesh_face // 8] + 4 * start, 3 * np.int64(faces[mesh]))
        for i in range(len(index)):
            if index[i] >= vertices[mesh]:
                found[0], found[1], found[2], found[3] = start + i, index[i], 1, vertices[mesh]
                return True
    return False
