"""Measures: named numbers that are read off a run, of which a sweep records a list."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import xarray as xr

from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice, reject
from magmotor.device.device import Measure, Scene

TRAJECTORY = "trajectory"
"""The measure that is the whole run; it stands alone."""


@checked
def measures(scene: Scene) -> dict[str, Measure]:
    """The measures of a kind of scene, by name.

    Raises
    ------
    ValueError
        It is no scene.
    """
    return dict(scene.device.measures)


class FromFile(str):
    """The name of a measure of a user's own that was read from a file: text, and never imported."""


def is_own(name: str) -> bool:
    """Whether a name is that of a function of the user's own, `package.module:function`."""
    return ":" in name


def measure_of(scene: Scene, name: str) -> Measure:
    """A measure by its name, or one of the user's own, which is imported when it is called.

    Raises
    ------
    ValueError
        There is none; lists those that there are.
    """
    if not is_own(name):
        known = measures(scene)
        check_choice("measure", name, (*known, TRAJECTORY))
        return known[name]
    module, function = name.split(":", 1)
    if not all(map(str.isidentifier, [*module.split("."), function])):
        raise reject("measure", str(name), "must be package.module:function")
    return Measure(lambda run, scene: imported(name)(run, scene), "1", function)


def imported(name: str) -> Callable[[xr.Dataset, Any], Any]:
    """The function of the user's own that a name stands for; nothing else imports by name.

    Raises
    ------
    ValueError
        The name is a file's, and nobody has allowed it, or there is no such function.
    """
    if isinstance(name, FromFile):
        sentence = (
            "a file names this function, which would run code; whoever runs it must allow it:"
            f" sweep_of and rerun take measures=[{str(name)!r}], scripts/rerun.py --allow-measure"
            f" {name}"
        )
        raise reject("measure", str(name), sentence)
    module, function = name.split(":", 1)
    try:
        found = getattr(import_module(module), function)
    except Exception as error:  # a module may raise anything
        raise reject(
            "measure", name, f"must be a function that can be imported ({error})"
        ) from None
    if not callable(found):
        raise reject(
            "measure", name, "must be a function that can be imported (it cannot be called)"
        )
    return found
