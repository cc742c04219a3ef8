"""MJCF parts: how they are read, and what in them only eyes need."""

from copy import copy
from functools import cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.environment import models_folder

Array = NDArray[np.float64]
Element = Any
"""A PyMJCF element: its attributes are those of the MJCF schema, unknown to type checkers."""


def compiled(root: Element) -> mujoco.MjModel:
    """The model of a PyMJCF tree or an MjSpec; ValueError if MuJoCo rejects it."""
    try:
        if isinstance(root, mujoco.MjSpec):
            return root.compile()
        return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())
    except ValueError as error:
        raise ValueError(
            f"MuJoCo cannot compile the model: {' '.join(str(error).split())}"
        ) from error


def load(name: str, *, visual: bool) -> Element:
    """A scene's MJCF as a PyMJCF tree of its own, without what only eyes need unless `visual`."""
    return copy(_read(name, visual))


@cache
def _read(name: str, visual: bool) -> Element:
    """The tree of a scene's MJCF with the parts that it includes; copies take a third as long."""
    try:
        from dm_control import mjcf
    except ModuleNotFoundError as missing:
        raise ModuleNotFoundError(
            "PyMJCF is missing: pip install --no-deps dm-control (with its dependencies it cannot"
            " be installed on Python 3.13 and newer, for which labmaze has no wheel)"
        ) from missing

    root = mjcf.from_path(str(models_folder() / f"{name}.xml"))
    if not visual:
        _strip(root)
    return root


def _strip(root: Element) -> None:
    """Remove lights, cameras, materials and the geoms of a visual class."""
    for kind in ("geom", "light", "camera", "material", "texture", "mesh"):
        for element in root.find_all(kind):
            if kind != "geom" or element.dclass is not None:
                element.remove()


def add_dipoles(body: Element, moment: float, positions: Array, directions: Array) -> None:
    """Add dipoles of a moment in A m^2 to a body: positions (n, 3) in its frame, directions."""
    for i, (position, direction) in enumerate(zip(positions, directions, strict=True)):
        place = {"pos": position, "zaxis": direction}
        body.add("site", name=f"{body.name}{i}", dclass="dipole", user=[moment], **place)


def solve_in_one_step(root: Element) -> None:
    """Take one step of conjugate gradients: enough for viscous contacts that bear no load.

    It is exact with R >> A and no normal dynamics. The tolerance is zero, so that it is taken at
    any slip.
    """
    root.option.set_attributes(solver="CG", iterations=1, ls_iterations=1, tolerance=0)


UNUSED = (
    "island", "equality", "frictionloss", "limit", "clampctrl", "eulerdamp", "sensor", "spring",
    "damper", "filterparent", "nativeccd", "warmstart",
)  # fmt: skip
"""Features of MuJoCo that the scenes do not use, but for few; each costs time in every step.

A warm start besides makes a step depend on more than the state.
"""


def disable_unused(root: Element, *, keep: tuple[str, ...] = ()) -> None:
    """Turn off unused features, but for those to keep."""
    root.option.flag.set_attributes(**{flag: "disable" for flag in UNUSED if flag not in keep})


def fit_stage(root: Element, center: ArrayLike, extent: float) -> None:
    """Have the stage's cameras and lights see a region as they saw the one it was made for."""
    center = np.asarray(center)
    statistic, world = root.statistic, root.worldbody
    zoom = extent / statistic.extent
    for element in [*world.light, *world.camera]:
        element.pos = center + zoom * (element.pos - statistic.center)
    floor = root.find("geom", "floor")
    floor.size = zoom * floor.size
    statistic.center, statistic.extent = center, extent
