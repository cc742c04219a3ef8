"""Geoms of iron of one rigid body that touch, but are not one piece."""

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.mjcf import declared, layout, memory
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.close_iron import WEAK
from magmotor.mjcf.checking.contact_rule import SUNK
from magmotor.mjcf.checking.failure import Failure
from magmotor.mjcf.declarations.reader import table_of
from magmotor.mjcf.declarations.table import PIECES
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.iron_unions import (
    COLUMNS,
    PIECE,
    RESPONSE,
    WORDS,
    find_responses,
    find_unions,
)
from magmotor.mjcf.lookup import label
from magmotor.numerics.compiled_once import compiled_once


def touching_pieces(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield geoms of iron that touch others of their rigid body, without being one piece."""
    rows = declared.rows(model, PIECES)
    if len(rows) < 2:
        return
    geoms, welds, piece = rows.geom.tolist(), rows.weld, unions_of(model, len(rows))[0]
    strong = np.array([declared.iron(model)[geom] >= WEAK for geom in geoms], bool)
    for k in np.flatnonzero(strong).tolist():
        geom, apart = geoms[k], (welds[:k] == welds[k]) & (piece[:k] != piece[k])
        for other in np.flatnonzero(apart & strong[:k]).tolist():
            near = float(SUNK * model.geom_rbound[[geom, geoms[other]]].min())
            gap = mujoco.mj_geomDistance(model, state, geom, geoms[other], near, None)
            if gap < near:
                yield Failure(
                    label(model, "geom", geom),
                    f"of iron touches geom {declared.name_of(model, 'geom', geoms[other])!r} of its"
                    " rigid body but is not one piece with it, so that forces may be wrong by 25 %;"
                    " of one material, boxes with parallel edges are one piece, and cylinders on"
                    " one axis",
                )
                break


def unions_of(model: mujoco.MjModel, count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return, for each of some declared geoms of iron, the first one of its piece; and addresses.

    Those are of the responses of pieces, and -1 for the other geoms of a piece.
    """
    room = np.empty(WORDS * (count + 1))
    acting_forces(model)  # binds what compiled code calls
    responses.bind()
    _find(layout.current())(model._address, room.ctypes.data, count)
    found = room[: COLUMNS * count].reshape(count, COLUMNS)[:, [PIECE, RESPONSE]].astype(np.int64)
    return found[:, 0], found[:, 1]


@compiled_once()
def _find(checksum: int, offsets: layout.Layout):
    """Define the function that finds which geoms of iron are one piece, and their responses."""

    def find(model, room, count):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        table = table_of(model, False)
        find_responses(find_unions(room, count, table, m, offsets), table, m, offsets)

    return find
