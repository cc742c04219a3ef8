"""A run as a labeled dataset whose attributes suffice to reproduce it."""

from typing import Any

import numpy as np
import xarray as xr

from magmotor.device.device import Scene
from magmotor.device.provenance import attributes_of, scene_of
from magmotor.device.states import concatenate

__all__ = ["assemble", "scene_of"]


def assemble(
    scene: Scene, chunks: list[Any], *, replicas: int | None = None, **attributes: Any
) -> xr.Dataset:
    """Build the dataset of a run from its recorded states.

    Parameters
    ----------
    scene : Top, Motor, Disk or LangevinParticle
        Stored in the attributes as JSON.
    chunks : list of states
        In chronological order, starting with the initial state.
    replicas : int, optional
        Their number, if the dataset is to have the dimension `replica`.
    **attributes
        Method, timestep, seed, etc.

    Returns
    -------
    xarray.Dataset
        Dimensions: time; replica; for vectors, space (x, y, z); for quaternions, component. The
        coordinates `replica` and `step` number the replicas and the steps of the Brownian path, so
        that even a part of the dataset identifies its noise.
    """
    states = concatenate(chunks)
    columns = scene.device.columns(scene, states, replicas)
    unit = scene.device.time_unit
    coordinates: dict[str, Any] = {
        "time": ("time", states.time, {"units": unit, "long_name": "time"})
    }
    dimensions = {dim for column in columns.values() for dim in column.dimensions}
    if "replica" in dimensions:
        coordinates["replica"] = np.arange(replicas or 1)
    if "record_interval" in attributes:
        steps = attributes["record_interval"] * np.arange(len(states.time))
        steps += attributes.get("first_step") or 0
        label = "step number on the Brownian path"
        coordinates["step"] = ("time", steps, {"units": "1", "long_name": label})
    if "space" in dimensions:
        coordinates["space"] = ["x", "y", "z"]
    data = xr.Dataset(
        {
            name: (dims, values, {"units": unit, "long_name": label})
            for name, (dims, values, unit, label) in columns.items()
        },
        coords=coordinates,
    )
    data.attrs = attributes_of(scene, replicas=replicas, **attributes)
    return data
