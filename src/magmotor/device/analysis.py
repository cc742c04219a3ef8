"""Analyses of runs: what a dataset must hold, and the scene that it was made from."""

from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np
import xarray as xr

from magmotor.common.arguments import arguments_of, guarded
from magmotor.common.checks import LARGEST, check_type, reject
from magmotor.device.device import Scene
from magmotor.device.provenance import scene_of

P = ParamSpec("P")
R = TypeVar("R")

OWN: Any = None
"""Default of the scene of an analysis: the run's own, which its attributes tell."""

VECTORS = ("position", "velocity", "axis", "angular_velocity", "slip_velocity")
INNER = {
    **dict.fromkeys((*VECTORS, "ring_axis", "ring_angular_velocity"), ("space",)),
    **dict.fromkeys(("orientation", "ring_orientation"), ("component",)),
}
"""The dimensions of a variable beside time and replica, if it has any."""

LENGTHS = {"space": 3, "component": 4}

OF_ENSEMBLES = {
    **dict.fromkeys(
        ("mean", "mean_error", "mean_square", "mean_square_error"), ("quantity", "time")
    ),
    **dict.fromkeys(("increment_correlation", "mean_square_increment"), ("lag",)),
    "path": ("path_replica", "time"),
    "flights": ("flight_duration",),
    "unfinished_flights": ("flight_duration",),
}
"""The dimensions of what only ensembles have."""

ORDER = ("replica", "path_replica", "quantity", "time", "space", "component")


def analysis(
    *needs: str, of: type[Scene] | tuple[type[Scene], ...], records: int = 1, replicas: bool = True,
    finite: bool = True,
) -> Callable[[Callable[P, R]], Callable[P, R]]:  # fmt: skip
    """Let an analysis of a run check it, its scene, and its other arguments by their hints.

    The first argument is the run. If the second is a scene, by default it is the run's own, and one
    that differs from that is refused.

    Parameters
    ----------
    *needs : str
        The variables that the analysis reads.
    of : type or tuple of type
        The kinds of scene whose runs it can read.
    records : int
        How many there must be at least.
    replicas : bool
        The run may have the dimension `replica`.
    finite : bool
        As of `magmotor.common.arguments.checked`.

    Returns
    -------
    decorator
        The analysis raises ValueError where the run or another argument is not what it needs.
    """
    kinds = of if isinstance(of, tuple) else (of,)

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        names = function.__code__.co_varnames[: function.__code__.co_argcount]
        with_scene = "scene" in names

        @wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            run, *rest = args or (kwargs.pop("run", None),)
            if with_scene:
                scene = rest.pop(0) if rest else kwargs.pop("scene", None)
                rest.insert(0, scene_of_run(run, scene, kinds))
            run = checked_run("run", run, needs, kinds, records=records, replicas=replicas)
            values, named = arguments_of(function, (run, *rest), kwargs)
            return guarded(function, finite, values, named)

        return call

    return decorate


def scene_of_run(run: Any, scene: Any, kinds: tuple[type[Scene], ...]) -> Any:
    """The scene of a run: that in its attributes, or where they have none the one that is given.

    Raises
    ------
    ValueError
        The run's own scene is of another kind or differs from the one that is given; the message
        names the field that differs. Or there is none at all.
    """
    check_type("run", run, xr.Dataset)
    if scene is not None:
        check_type("scene", scene, *kinds)
    if "scene" not in run.attrs:
        if scene is None:
            raise reject("scene", None, "must be given, since the run's attributes do not tell it")
        return scene
    own = scene_of(run)
    _check_kind_of_run("run", type(own).__name__, kinds)
    if scene is None or scene == own:
        return own
    if type(scene) is not type(own):
        raise reject("scene", scene, f"must be the run's own, a {type(own).__name__}")
    fields = [name for name in vars(own) if getattr(scene, name) != getattr(own, name)]
    name = fields[0]
    raise reject(
        f"scene.{name}", getattr(scene, name), f"must be {getattr(own, name)!r}, as in the run"
    )


def _check_kind_of_run(name: str, told: Any, kinds: tuple[type[Scene], ...]) -> None:
    names = [known.__name__ for kind in kinds for known in kind.registered()]
    if told not in names:
        raise ValueError(f"{name} is of a {told!s:.40}: must be of a {' or '.join(names)}")


def checked_run(
    name: str,
    run: Any,
    needs: tuple[str, ...],
    kinds: tuple[type[Scene], ...],
    *,
    records: int = 1,
    replicas: bool = True,
) -> xr.Dataset:
    """Return a run, its dimensions in the usual order, if it has all that an analysis reads.

    Raises
    ------
    ValueError
        Names what is missing, of other dimensions, no number or not finite.
    """
    check_type(name, run, xr.Dataset)
    if "scene" in run.attrs:
        _check_kind_of_run(name, run.attrs["scene"], kinds)
    missing = [needed for needed in needs if needed not in run.data_vars]
    if missing:
        sentence = f"must be a dataset that has {', '.join(missing)}, too"
        raise reject(name, [*map(str, run.data_vars)], sentence)
    if not replicas and "replica" in run.dims:
        raise reject("replicas", run.sizes["replica"], f"must be one: {name}.isel(replica=0)")
    if any(_is_misordered(run[needed]) for needed in needs):
        run = run.transpose(*ORDER, ..., missing_dims="ignore")
    for needed in needs:
        _check_variable(f"{name}.{needed}", run[needed])
    if any("time" in run[needed].dims for needed in needs):
        _check_time(name, run, records)
    _check_replicas(name, run)
    if "space" in run.coords and [*run.space.values] != ["x", "y", "z"]:
        raise reject(f"{name}.space", [*map(str, run.space.values)], "must be x, y, z")
    return run


def _check_replicas(name: str, run: xr.Dataset) -> None:
    """Check that records and replicas are a run's own: not joined of several runs, nor means."""
    known = run.attrs.get("replicas")
    if "replica" in run.coords and isinstance(known, int | np.integer):
        numbers = np.atleast_1d(run.replica.values)
        own = numbers.dtype.kind in "iu" and len(np.unique(numbers)) == len(numbers)
        if not own or not ((numbers >= 0) & (numbers < known)).all():
            sentence = f"must be different numbers, each less than {known}"
            raise reject(f"{name}.replica", numbers.tolist(), sentence)
    if known is not None and "sample_interval" not in run.attrs and "replica" not in run.coords:
        raise reject(
            f"{name}.replica", None, "must be a coordinate with the numbers of the replicas"
        )
    if "step" in run.coords and run.step.dtype.kind not in "iu":
        raise reject(
            f"{name}.step", str(run.step.dtype), "must be integers: records of a run, not means"
        )
    if "step" in run.coords and not (np.diff(run.step.values.ravel().astype(int)) > 0).all():
        raise ValueError(f"{name}.step must increase, as in one run")


def _check_orientation(name: str, variable: xr.DataArray) -> None:
    """Check that quaternions are of length 1, but for the rounding of single precision."""
    lengths = np.linalg.norm(variable.values, axis=-1)
    if not (np.abs(lengths - 1) < 1e-3).all():
        worst = float(lengths.flat[np.abs(lengths - 1).argmax()])
        raise reject(f"length of a quaternion in {name}", worst, "must be 1")


def _is_misordered(variable: xr.DataArray) -> bool:
    return variable.dims != tuple(dim for dim in ORDER if dim in variable.dims)


def _check_variable(name: str, variable: xr.DataArray) -> None:
    short = name.rpartition(".")[2]
    expected = OF_ENSEMBLES.get(short) or ("time", *INNER.get(short, ()))
    dims = variable.dims[1:] if variable.dims[:1] == ("replica",) else variable.dims
    if dims != expected:
        raise reject(f"dimensions of {name}", variable.dims, f"must be {expected}, of one run")
    for dim in map(str, dims):
        if variable.sizes[dim] != LENGTHS.get(dim, variable.sizes[dim]):
            raise reject(
                f"length of {dim} in {name}", variable.sizes[dim], f"must be {LENGTHS[dim]}"
            )
    if not variable.size:
        raise reject(f"shape of {name}", variable.shape, "must be of an array that is not empty")
    if variable.dtype.kind not in "iuf":
        raise reject(f"dtype of {name}", str(variable.dtype), "must be a number's")
    if not (np.abs(variable.values) <= LARGEST).all():
        raise ValueError(f"{name} holds values that are not finite or exceed {LARGEST:g}")
    if short.endswith("orientation"):
        _check_orientation(name, variable)


def _check_time(name: str, run: xr.Dataset, records: int) -> None:
    if "time" not in run.coords or run.time.dtype.kind not in "iuf":
        raise reject(f"{name}.time", None, "must be a coordinate of numbers")
    times = run.time.values
    if not (np.abs(times) <= LARGEST).all() or not (np.diff(times) > 0).all():
        raise ValueError(f"{name}.time must hold finite times that increase")
    if len(times) < records:
        raise reject(f"number of records in {name}", len(times), f"must be at least {records}")
