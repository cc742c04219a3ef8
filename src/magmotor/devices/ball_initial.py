"""The initial state of a run: the scene's own, with parts replaced."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from magmotor.checks import check_choice, reject
from magmotor.scenes import Top
from magmotor.states.ball import BallStates, smallest_turn, start

PARTS = {"position": 3, "velocity": 3, "axis": 3, "angular_velocity": 3, "orientation": 4}


def initial_state(
    scene: Top, initial: Mapping[str, Any] | xr.Dataset | None, replicas: None = None
) -> BallStates:
    """The state that a run starts from, as one row; see `simulate` for `initial`.

    Raises
    ------
    ValueError
        Names the part, its value and the bound.
    """
    if isinstance(initial, xr.Dataset):
        initial = {name: initial[name].values[-1] for name in PARTS if name in initial}
    elif initial is not None and {"axis", "orientation"} <= initial.keys():
        raise reject("initial", [*initial], "given with axis or orientation, not both")
    rows = {name: _row(scene, name, value) for name, value in (initial or {}).items()}
    if "orientation" in rows:
        turn = Rotation.from_quat(rows["orientation"], scalar_first=True)
        rows["axis"] = turn.apply([0.0, 0.0, 1.0])
    elif "axis" in rows:
        rows["orientation"] = smallest_turn(rows["axis"])
    return start(scene)._replace(**{name: row[np.newaxis] for name, row in rows.items()})


def _row(scene: Top, name: str, value: Any) -> NDArray[np.float64]:
    check_choice("initial", name, tuple(PARTS))
    label, size = f"initial[{name!r}]", PARTS[name]
    row = np.asarray(value, dtype=float)
    on_plane = {"position": scene.ball_radius, "velocity": 0.0}
    if name in on_plane and row.shape == (2,):
        row = np.append(row, on_plane[name])
    if row.shape != (size,) or not np.isfinite(row).all():
        raise reject(label, value, f"{size} finite numbers")
    if name in on_plane and scene.surface == "planar" and row[2] != on_plane[name]:
        raise reject(label, value, f"{on_plane[name]:g} along z on the plane")
    if name in ("axis", "orientation"):
        if not row.any():
            raise reject(label, value, "not all zero")
        row = row / np.linalg.norm(row)
    return row
