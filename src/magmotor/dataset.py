"""A run as a labelled dataset that says, in its attributes, how to make it again."""

import dataclasses
import json
from importlib.metadata import version
from typing import Any

import xarray as xr

from magmotor.engines.state import States, concatenate
from magmotor.observables.motion import energy, momentum_map, slip_velocity
from magmotor.scenes import Top

SCENES = {"Top": Top}

UNITS = {
    "time": ("s", "time"),
    "position": ("m", "position of the ball's centre"),
    "velocity": ("m/s", "velocity of the ball's centre"),
    "axis": ("1", "axis xi_3 of the ball, the direction of its dipole"),
    "angular_velocity": ("rad/s", "angular velocity in the world frame"),
    "orientation": ("1", "orientation of the ball, unit quaternion (w, x, y, z)"),
    "slip_velocity": ("m/s", "slip velocity V_Q of the contact point"),
    "momentum_map": ("kg m^2/s", "momentum map J = pi . xi_3"),
    "energy": ("J", "total energy"),
}


def assemble(scene: Top, chunks: list[States], **attributes: Any) -> xr.Dataset:
    """Make the dataset of a run from its recorded states.

    Parameters
    ----------
    scene : Top
        Goes into the attributes as JSON.
    chunks : list of States
        In the order of time, the initial state first.
    **attributes
        Method, timestep, seed and so on.

    Returns
    -------
    xarray.Dataset
        Dimensions time, space (x, y, z) and component (of quaternions).
    """
    states = concatenate(chunks)
    spin = states.angular_velocity
    columns = {
        "position": states.position,
        "velocity": states.velocity,
        "axis": states.axis,
        "angular_velocity": spin,
        "slip_velocity": slip_velocity(scene, states.velocity, spin),
        "momentum_map": momentum_map(scene, states.axis, spin),
        "energy": energy(scene, states),
    }
    dims = {name: ("time", "space")[: values.ndim] for name, values in columns.items()}
    if states.orientation is not None:
        columns["orientation"] = states.orientation
        dims["orientation"] = ("time", "component")
    data = xr.Dataset(
        {name: (dims[name], values, _describe(name)) for name, values in columns.items()},
        coords={"time": ("time", states.time, _describe("time")), "space": ["x", "y", "z"]},
    )
    versions = {name: version(name) for name in ("magmotor", "mujoco", "numba", "numpy", "scipy")}
    data.attrs = {
        "scene": type(scene).__name__,
        "scene_fields": json.dumps(dataclasses.asdict(scene)),
        "versions": json.dumps(versions),
        **{name: value for name, value in attributes.items() if value is not None},
    }
    return data


def states_of(run: xr.Dataset) -> States:
    """The recorded states in a dataset."""
    orientation = run["orientation"].values if "orientation" in run else None
    return States(*[run[name].values for name in States._fields[:-1]], orientation=orientation)


def scene_of(run: xr.Dataset) -> Top:
    """The scene that a dataset was made from.

    Raises
    ------
    ValueError
        The dataset names no scene that is known here.
    """
    name = run.attrs.get("scene")
    if name not in SCENES:
        raise ValueError(
            f"scene = {name!r} in the dataset's attributes: must be one of {[*SCENES]}"
        )
    stored = json.loads(run.attrs["scene_fields"])
    fields: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in stored.items()}
    return SCENES[name](**fields)


def _describe(name: str) -> dict[str, str]:
    units, long_name = UNITS[name]
    return {"units": units, "long_name": long_name}
