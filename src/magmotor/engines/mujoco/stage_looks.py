"""The stage, its lights and its cameras, fitted to what stands on it."""

import numpy as np
from numpy.typing import ArrayLike

from magmotor.engines.mujoco import parts


def fit_stage(root: parts.Element, centre: ArrayLike, extent: float) -> None:
    """Have the stage's cameras and lights see a region as they saw the one it was made for."""
    centre = np.asarray(centre)
    statistic, world = root.statistic, root.worldbody
    zoom = extent / statistic.extent
    for element in [*world.light, *world.camera]:
        element.pos = centre + zoom * (element.pos - statistic.center)
    floor = root.find("geom", "floor")
    floor.size = zoom * floor.size
    statistic.center, statistic.extent = centre, extent
