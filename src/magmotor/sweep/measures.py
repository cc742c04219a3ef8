"""Measures: named numbers that a sweep records for each run."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import xarray as xr

from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice
from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import Scene
from magmotor.device.observable import Measure

TRAJECTORY = "trajectory"
"""Name of the measure that records the whole run; a sweep with it has no other measure."""


@checked
def measures(scene: Scene) -> dict[str, Measure]:
    """Return the measures for a scene, by name.

    Raises
    ------
    ValueError
        The argument is not a scene.
    """
    return dict(scene.device.measures)


class FromFile(str):
    """Name of a user-defined measure that was read from a file and must not be imported."""


def is_own(name: str) -> bool:
    """Whether a name is that of a user-defined measure, `package.module:function`."""
    return ":" in name


OF_SCRIPT = "put it into a file of its own, such as measures.py, since workers do not run this one"


def named(function: Callable[..., Any]) -> str:
    """Return how a user-defined measure is named, in words."""
    name = getattr(function, "__name__", "function")
    if getattr(function, "__module__", None) in (None, "__main__"):
        return f"'module:{name}': {OF_SCRIPT}, and write 'measures:{name}'"
    return f"'module:function': write '{function.__module__}:{name}'"


def measure_of(scene: Scene, name: str) -> Measure:
    """Return a measure by its name; a user-defined function is imported only when it is called.

    Raises
    ------
    ValueError
        There is no such measure; the message lists the measures of the scene.
    """
    if not is_own(name):
        available = measures(scene)
        check_choice("measure", name, (*available, TRAJECTORY))
        return available[name]
    module, function = name.split(":", 1)
    if not all(map(str.isidentifier, [*module.split("."), function])):
        raise ArgumentError("measure", str(name), "must have the form package.module:function")
    if module == "__main__":
        raise ArgumentError("measure", str(name), f"{OF_SCRIPT}, and write 'measures:{function}'")
    return Measure(lambda run, scene: imported(name)(run, scene), "1", function)


def imported(name: str) -> Callable[[xr.Dataset, Any], Any]:
    """Import the function of a user-defined measure; nothing else is imported by name.

    Raises
    ------
    ValueError
        The name is from a file and has not been allowed, or there is no such function.
    """
    if isinstance(name, FromFile):
        sentence = (
            "must be allowed explicitly, since its name is from a file: pass"
            f" measures=[{str(name)!r}] to sweep_of or rerun, or run magmotor rerun"
            f" --allow-measure {name}"
        )
        raise ArgumentError("measure", str(name), sentence)
    module, function = name.split(":", 1)
    try:
        imported_function = getattr(import_module(module), function)
    except Exception as error:  # a module may raise anything
        raise ArgumentError(
            "measure", name, f"must be a function that can be imported ({error})"
        ) from None
    if not callable(imported_function):
        raise ArgumentError(
            "measure", name, "must be a function that can be imported (it is not callable)"
        )
    return imported_function
