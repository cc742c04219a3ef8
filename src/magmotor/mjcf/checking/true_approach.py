"""What pulls two magnets of true shape where they come nearest to each other.

Geoms of other bodies that move along with them keep them apart, and so do their joints.
"""

import numpy as np
from numpy.typing import NDArray

from magmotor.mjcf.checking.clearance import Clearance
from magmotor.mjcf.checking.dipole_depth import Side
from magmotor.mjcf.checking.poses import Freedom, Pose, any_poses, beside, quarters
from magmotor.mjcf.checking.true_pull import Duo

LOWER = 0.99
"""Distance, over that straight above, below which magnets come nearer to each other aside."""

MOVED = 24
"""Largest number of pairs of faces for which places aside of what is in the way are tried."""

TURNED = 0.5
"""Part of the largest force so far from which iron that attracts is also turned by quarters."""


class TrueApproach:
    """How near two magnets come, and what pulls them there.

    `acts` (n, m) says which dipoles act on which.
    """

    def __init__(
        self,
        duo: Duo,
        sides: tuple[Side, Side],
        clearance: Clearance,
        freedom: Freedom,
        acts: NDArray[np.bool_],
    ) -> None:
        self._duo, self._sides, self._clearance = duo, sides, clearance
        self._poses = [*(any_poses(sides, acts) if freedom.whole else freedom.poses(sides))]
        magnets = [side.magnet for side in sides]
        self._coiled = any(magnet.coils - {-1} for magnet in magnets)
        self._soft = not all(magnet.strengths.any() for magnet in magnets)
        self._free = freedom.whole

    def pull(self, least: float, step: float) -> tuple[float, float]:
        """Return the largest force in N of all poses, and its gradient in N/m, over a step in m.

        Dipoles are `least` or more from each other. With coils, the force may have either sign.
        """
        places = self._places(least, self._poses)
        forces = [self._force(*each) for each in places]
        best = max(forces, default=0.0)
        if self._free:
            pairs = zip(places, forces, strict=True)
            chosen = [
                pose for (pose, _), force in pairs if force >= TURNED * best or not self._soft
            ]
            more = self._places(least, [turned for pose in chosen for turned in quarters(pose)])
            places, forces = places + more, forces + [self._force(*each) for each in more]
        order = sorted(range(len(forces)), key=lambda k: -forces[k])
        for k in (k for k in order if forces[k] > 0):
            pose, height = places[k]
            gradient = (forces[k] - self._force(pose, height + step)) / step
            if gradient > 0:  # it is not where a magnet passes an edge, which models describe worst
                return forces[k], gradient
        return 0.0, 0.0

    def _force(self, pose: Pose, height: float) -> float:
        found = float(self._duo.force(pose.turn, pose.shift + height * pose.normal) @ pose.normal)
        found = float(np.nan_to_num(found, nan=0.0))
        return abs(found) if self._coiled else found

    def _places(self, least: float, poses: list[Pose]) -> list[tuple[Pose, float]]:
        """Return the poses and how far the second magnet is along the normal in each."""
        found, moved = [], 0
        for pose in poses:
            ends = [self._least(pose, start) for start in pose.starts(least)]
            found += [(pose, height) for height, _ in ends]
            height, held = ends[0]
            if held and self._free and moved < MOVED:
                moved += 1
                others = [(each, self._least(each, least)[0]) for each in beside(self._sides, pose)]
                found += [each for each in others if each[1] < LOWER * height]
        return [each for each in found if each[1] < np.inf]

    def _least(self, pose: Pose, start: float) -> tuple[float, bool]:
        return self._clearance.least(pose.turn, pose.shift, pose.normal, start)
