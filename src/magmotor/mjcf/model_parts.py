"""MJCF files: loading, stripping of visual elements, and common changes of options."""

import re
from copy import copy
from functools import cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arrays import Array
from magmotor.common.environment import data_folder
from magmotor.common.exceptions import InputError
from magmotor.common.optional import extra

Element = Any
"""A PyMJCF element, whose attributes follow the MJCF schema and are unknown to type checkers."""


def compiled(root: Element) -> mujoco.MjModel:
    """Compile a PyMJCF tree or an MjSpec; raise ValueError if MuJoCo rejects it."""
    try:
        if isinstance(root, mujoco.MjSpec):
            return root.compile()
        return mujoco.MjModel.from_xml_string(xml_of(root), root.get_assets())
    except ValueError as error:
        raise InputError(
            f"MuJoCo cannot compile the model: {' '.join(str(error).split())}"
        ) from error


def spec_of(root: Element) -> mujoco.MjSpec:
    """Return a PyMJCF tree or an MjSpec as a new MjSpec."""
    if isinstance(root, mujoco.MjSpec):
        return root.copy()
    return mujoco.MjSpec.from_string(xml_of(root), assets=root.get_assets())


def xml_of(root: Element) -> str:
    """The MJCF of a PyMJCF tree, without the names that PyMJCF gives to what has none."""
    return re.sub(r' name="//unnamed[^"]*"', "", root.to_xml_string())


def load(name: str, *, visual: bool) -> Element:
    """Load a scene's MJCF as a new PyMJCF tree, without visual elements unless `visual`."""
    return copy(_read(name, visual))


@cache
def _read(name: str, visual: bool) -> Element:
    """Parse a scene's MJCF with its includes; cached, since a copy takes a third of the time."""
    with extra("scenes"):
        from dm_control import mjcf

    root = mjcf.from_path(str(data_folder("models") / "parts" / f"{name}.xml"))
    if not visual:
        _strip(root)
    return root


def _strip(root: Element) -> None:
    """Remove lights, cameras, materials and the geoms that belong to a visual class."""
    for kind in ("geom", "light", "camera", "material", "texture", "mesh"):
        for element in root.find_all(kind):
            if kind != "geom" or element.dclass is not None:
                element.remove()


def add_dipoles(body: Element, moment: float, positions: Array, directions: Array) -> None:
    """Add dipoles of a moment in A m^2 to a body.

    The positions and directions, shape (n, 3), are in the body's frame.
    """
    for i, (position, direction) in enumerate(zip(positions, directions, strict=True)):
        pose = {"pos": position, "zaxis": direction}
        body.add("site", name=f"{body.name}{i}", dclass="dipole", user=[moment], **pose)


def mark(root: Element, kinds: str) -> None:
    """Declare which of a model's user numbers and tuples are magnetic; see `magnetism`."""
    root.custom.add("text", name="magmotor", data=kinds)


def solve_in_one_step(root: Element) -> None:
    """Make the solver take one conjugate gradient step.

    This is exact for viscous contacts that bear no load: R >> A, and there are no normal dynamics.
    With a tolerance of zero, the step is taken for any slip.
    """
    root.option.set_attributes(solver="CG", iterations=1, ls_iterations=1, tolerance=0)


UNUSED = (
    "island", "equality", "frictionloss", "limit", "clampctrl", "eulerdamp", "sensor", "spring",
    "damper", "filterparent", "nativeccd", "warmstart",
)  # fmt: skip
"""MuJoCo features that few scenes use; each costs time in every step.

Moreover, a warm start makes a step depend on more than the state.
"""


def disable_unused(root: Element, *, keep: tuple[str, ...] = ()) -> None:
    """Disable unused features, except those in `keep`."""
    root.option.flag.set_attributes(**{flag: "disable" for flag in UNUSED if flag not in keep})


def fit_stage(root: Element, center: ArrayLike, radius: float) -> None:
    """Scale and move the stage's cameras, lights and floor to fit a region of this radius in m."""
    center = np.asarray(center)
    statistic, world = root.statistic, root.worldbody
    zoom = 2 * radius / statistic.extent
    for element in [*world.light, *world.camera]:
        element.pos = center + zoom * (element.pos - statistic.center)
    floor = root.find("geom", "floor")
    floor.size = zoom * floor.size
    statistic.center, statistic.extent = center, 2 * radius
