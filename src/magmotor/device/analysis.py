"""Checks of the datasets that analyses read, and of the scenes that they came from."""

from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np
import xarray as xr

from magmotor.common.arguments import arguments_of, guarded
from magmotor.common.checks import LARGEST, check_type
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.device.device import Scene
from magmotor.device.provenance import scene_of

P = ParamSpec("P")
R = TypeVar("R")

OWN: Any = None
"""Default for the scene of an analysis: the one recorded in the run's attributes."""

VECTORS = ("position", "velocity", "axis", "angular_velocity", "slip_velocity")
INNER_DIMENSIONS = {
    **dict.fromkeys((*VECTORS, "ring_axis", "ring_angular_velocity"), ("space",)),
    **dict.fromkeys(("orientation", "ring_orientation"), ("component",)),
}
"""Dimensions of vector variables in addition to replica and time."""

LENGTHS = {"space": 3, "component": 4}

ENSEMBLE_DIMENSIONS = {
    **dict.fromkeys(
        ("mean", "mean_error", "mean_square", "mean_square_error"), ("quantity", "time")
    ),
    **dict.fromkeys(("increment_correlation", "mean_square_increment"), ("lag",)),
    "path": ("path_replica", "time"),
    "flights": ("flight_duration",),
    "unfinished_flights": ("flight_duration",),
}
"""Dimensions of the variables that only ensembles have."""

DIMENSION_ORDER = ("replica", "path_replica", "quantity", "time", "space", "component")


def analysis(
    *needs: str, of: type[Scene] | tuple[type[Scene], ...], records: int = 1, replicas: bool = True,
    finite: bool = True,
) -> Callable[[Callable[P, R]], Callable[P, R]]:  # fmt: skip
    """Make an analysis check its run, its scene, and its other arguments by their hints.

    The first parameter must be `run`. If the second is `scene`, it defaults to the run's own scene,
    and a different one is refused.

    Parameters
    ----------
    *needs : str
        Variables that the analysis reads.
    of : type or tuple of type
        Scene classes whose runs the analysis accepts.
    records : int
        Least number of records.
    replicas : bool
        Whether the run may have the dimension `replica`.
    finite : bool
        See `magmotor.common.arguments.checked`.

    Returns
    -------
    decorator
        The decorated analysis raises ValueError if the run or another argument is invalid.
    """
    scene_classes = of if isinstance(of, tuple) else (of,)

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        names = function.__code__.co_varnames[: function.__code__.co_argcount]
        with_scene = "scene" in names

        @wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            run, *rest = args or (kwargs.pop("run", None),)
            if with_scene:
                scene = rest.pop(0) if rest else kwargs.pop("scene", None)
                rest.insert(0, scene_of_run(run, scene, scene_classes))
            run = checked_run("run", run, needs, scene_classes, records=records, replicas=replicas)
            values, named = arguments_of(function, (run, *rest), kwargs)
            return guarded(function, finite, values, named)

        return call

    return decorate


def scene_of_run(run: Any, scene: Any, scene_classes: tuple[type[Scene], ...]) -> Any:
    """Return the scene in a run's attributes, or the given one if the attributes have none.

    Raises
    ------
    ValueError
        There is no scene, or the run's own scene is of another class, or it differs from the given
        one; the message names the field that differs.
    """
    if not isinstance(run, xr.Dataset) and isinstance(scene, xr.Dataset):
        sentence = "must be the dataset, and `scene` its scene: exchange these two arguments"
        raise ArgumentError("run", run, sentence)
    check_type("run", run, xr.Dataset)
    if scene is not None:
        check_type("scene", scene, *scene_classes)
    if "scene" not in run.attrs:
        if scene is None:
            raise ArgumentError(
                "scene", None, "must be given, since the run's attributes have no scene"
            )
        return scene
    own = scene_of(run)
    _check_scene_class("run", type(own).__name__, scene_classes)
    if scene is None or scene == own:
        return own
    if type(scene) is not type(own):
        sentence = f"must be the scene of the run, a {type(own).__name__}, or None for that scene"
        raise ArgumentError("scene", scene, sentence)
    fields = [name for name in vars(own) if getattr(scene, name) != getattr(own, name)]
    name = fields[0]
    raise ArgumentError(
        f"scene.{name}", getattr(scene, name), f"must be {getattr(own, name)!r}, as in the run"
    )


def _check_scene_class(name: str, recorded: Any, scene_classes: tuple[type[Scene], ...]) -> None:
    names = [known.__name__ for base in scene_classes for known in base.registered()]
    if not isinstance(recorded, str) or recorded not in names:
        raise InputError(f"{name} is of a {recorded!s:.40}: must be of a {' or '.join(names)}")


def checked_run(
    name: str,
    run: Any,
    needs: tuple[str, ...],
    scene_classes: tuple[type[Scene], ...],
    *,
    records: int = 1,
    replicas: bool = True,
) -> xr.Dataset:
    """Return a run with its dimensions in the usual order, if it has all that an analysis reads.

    Raises
    ------
    ValueError
        A variable is missing, or has other dimensions, a wrong type or values that are not finite;
        the message names it.
    """
    check_type(name, run, xr.Dataset)
    if "scene" in run.attrs:
        _check_scene_class(name, run.attrs["scene"], scene_classes)
    missing = [needed for needed in needs if needed not in run.data_vars]
    if missing:
        sentence = f"the dataset must also have {', '.join(missing)}"
        raise ArgumentError(name, [*map(str, run.data_vars)], sentence)
    if not replicas and "replica" in run.dims:
        raise ArgumentError("replicas", run.sizes["replica"], f"select one: {name}.isel(replica=0)")
    if any(_is_misordered(run[needed]) for needed in needs):
        run = run.transpose(*DIMENSION_ORDER, ..., missing_dims="ignore")
    for needed in needs:
        _check_variable(f"{name}.{needed}", run[needed])
    if any("time" in run[needed].dims for needed in needs):
        _check_time(name, run, records)
    _check_replicas(name, run)
    _check_space(name, run, needs)
    return run


def _check_space(name: str, run: xr.Dataset, needs: tuple[str, ...]) -> None:
    """Check the names of the vectors' components."""
    if "space" not in run.coords:
        for needed in needs:
            if "space" in run[needed].dims:
                raise ArgumentError(f"{name}.{needed}.space", None, "must be a coordinate: x, y, z")
    elif [*run.space.values] != ["x", "y", "z"]:
        raise ArgumentError(f"{name}.space", [*map(str, run.space.values)], "must be x, y, z")


def _check_replicas(name: str, run: xr.Dataset) -> None:
    """Check that records and replicas come from one run, and are not averages."""
    count = run.attrs.get("replicas")
    if "replica" in run.coords and isinstance(count, int | np.integer):
        numbers = np.atleast_1d(run.replica.values)
        distinct = numbers.dtype.kind in "iu" and len(np.unique(numbers)) == len(numbers)
        if not distinct or not ((numbers >= 0) & (numbers < count)).all():
            sentence = f"must be distinct numbers, each less than {count}"
            raise ArgumentError(f"{name}.replica", numbers.tolist(), sentence)
    if count is not None and "sample_interval" not in run.attrs and "replica" not in run.coords:
        raise ArgumentError(
            f"{name}.replica", None, "must be a coordinate with the numbers of the replicas"
        )
    if "step" in run.coords and run.step.dtype.kind not in "iu":
        raise ArgumentError(
            f"{name}.step",
            str(run.step.dtype),
            "must be integers: the records must be a run's own, not averages",
        )
    if "step" in run.coords and not (np.diff(run.step.values.ravel().astype(int)) > 0).all():
        raise InputError(f"{name}.step must increase: the records must be of one run")


def _check_orientation(name: str, variable: xr.DataArray) -> None:
    """Check that quaternions have length 1, up to the rounding of single precision."""
    lengths = np.linalg.norm(variable.values, axis=-1)
    if not (np.abs(lengths - 1) < 1e-3).all():
        worst = float(lengths.flat[np.abs(lengths - 1).argmax()])
        raise ArgumentError(f"length of a quaternion in {name}", worst, "must be 1")


def _is_misordered(variable: xr.DataArray) -> bool:
    return variable.dims != tuple(dim for dim in DIMENSION_ORDER if dim in variable.dims)


def _check_variable(name: str, variable: xr.DataArray) -> None:
    short = name.rpartition(".")[2]
    expected = ENSEMBLE_DIMENSIONS.get(short) or ("time", *INNER_DIMENSIONS.get(short, ()))
    dims = variable.dims[1:] if variable.dims[:1] == ("replica",) else variable.dims
    if dims != expected:
        raise ArgumentError(f"dimensions of {name}", variable.dims, f"must be {expected}")
    for dim in map(str, dims):
        if variable.sizes[dim] != LENGTHS.get(dim, variable.sizes[dim]):
            raise ArgumentError(
                f"length of {dim} in {name}", variable.sizes[dim], f"must be {LENGTHS[dim]}"
            )
    if not variable.size:
        raise ArgumentError(f"shape of {name}", variable.shape, "the array must not be empty")
    if variable.dtype.kind not in "iuf":
        raise ArgumentError(f"dtype of {name}", str(variable.dtype), "must be real numbers")
    if not (np.abs(variable.values) <= LARGEST).all():
        raise InputError(f"{name} holds values that are not finite or exceed {LARGEST:g}")
    if short.endswith("orientation"):
        _check_orientation(name, variable)


def _check_time(name: str, run: xr.Dataset, records: int) -> None:
    if "time" not in run.coords or run.time.dtype.kind not in "iuf":
        raise ArgumentError(f"{name}.time", None, "must be a coordinate of numbers")
    times = run.time.values
    if not (np.abs(times) <= LARGEST).all() or not (np.diff(times) > 0).all():
        raise InputError(f"{name}.time must hold finite times that increase")
    if len(times) < records:
        raise ArgumentError(
            f"number of records in {name}", len(times), f"must be at least {records}"
        )
