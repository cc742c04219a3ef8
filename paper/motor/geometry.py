"""What the radii, heights and dipoles of the motor's rings decide without a run."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from magmotor.device.observable import labeled
from magmotor.devices.motor.ring_stability import ring_stiffness
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import motor_wells

LABELS = {
    "outer_radius": ("m", "radius of the outer ring"),
    "inner_height": ("m", "height of both rings"),
    "outer_height": ("m", "height of the outer ring"),
    "inner_dipoles": ("1", "number of dipoles N on the inner ring"),
    "outer_dipoles": ("1", "number of dipoles M on the outer ring"),
    "barrier": ("kT", "barrier between two wells under a level ring"),
    "lean": ("°", "thermal lean of the inner ring"),
}


def statics(scene: Motor, vary: Mapping[Any, ArrayLike]) -> xr.Dataset:
    """Compute the barrier and the thermal lean of the ring over a grid of two fields.

    Parameters
    ----------
    scene : Motor
        At uniform temperature.
    vary : mapping
        Values of two fields, or of several fields that are equal, as in a sweep; a coordinate has
        the name of the first of them.

    Returns
    -------
    xarray.Dataset
        `barrier`, V_e between two wells minus that in a well, in kT; it is negative where the wells
        are between the outer dipoles. `lean`, sqrt(kT/k) in degrees for the stiffness k of the
        level ring; NaN where the level ring is unstable.
    """
    names = [name if isinstance(name, tuple) else (name,) for name in vary]
    grids = [np.asarray(values) for values in vary.values()]
    shape = tuple(map(len, grids))
    barrier, lean = np.empty(shape), np.empty(shape)
    for index in np.ndindex(shape):
        changes: dict[str, Any] = {
            field: grid[k].item()
            for fields, grid, k in zip(names, grids, index, strict=True)
            for field in fields
        }
        changed = scene.replace(**changes)
        barrier[index] = motor_wells(changed).barrier / scene.kT
        stiffness = ring_stiffness(changed)
        lean[index] = np.degrees(np.sqrt(scene.kT / stiffness)) if stiffness > 0 else np.nan
    axes = [fields[0] for fields in names]
    columns = {"barrier": (axes, barrier), "lean": (axes, lean)}
    return labeled(xr.Dataset(columns, dict(zip(axes, grids, strict=True))), LABELS)
