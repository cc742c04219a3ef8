"""The effective potential over some places, with its critical points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor import observables
from magmotor.devices.top.scene import Top
from magmotor.observables import CriticalPoint


@dataclass(frozen=True)
class Landscape:
    """V_e of a scene in J, shape of the places, and all its critical points, deepest first."""

    scene: Top
    values: NDArray[np.float64]
    points: list[CriticalPoint]

    def of(self, kind: str) -> list[CriticalPoint]:
        """The critical points of a kind: minimum, saddle or maximum."""
        return [point for point in self.points if point.kind == kind]


def landscape(scene: Top, places: ArrayLike) -> Landscape:
    """V_e at places on the plane, shape (..., 2), in m."""
    values = observables.effective_potential(scene, places)
    return Landscape(scene, values, observables.critical_points(scene))
