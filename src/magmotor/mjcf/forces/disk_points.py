"""Points and weights by which charges of a disk are integrated, for each order of charges.

Seven points are exact for polynomials up to degree 5 (J. Radon, Monatsh. Math. 52 (1948) 286). For
the higher orders, n rings at the Gauss points of the squared radius have 4 n points each, which is
exact up to degree 4 n - 1 (W. H. Peirce, J. Soc. Ind. Appl. Math. 5 (1957) 66).
"""

import numpy as np

_COSINES = {
    2: (0.9238795325112867, 0.3826834323650898),
    3: (0.9659258262890683, 0.7071067811865476, 0.25881904510252074),
    4: (0.9807852804032304, 0.8314696123025452, 0.5555702330196022, 0.19509032201612828),
}
"""Cosines of the angles of a ring in the first quadrant, where their sines are the same numbers."""

_RINGS = {
    2: ((0.21132486540518708, 0.5), (0.7886751345948129, 0.5)),
    3: (
        (0.1127016653792583, 0.2777777777777778),
        (0.5, 0.4444444444444444),
        (0.8872983346207417, 0.2777777777777778),
    ),
    4: (
        (0.06943184420297371, 0.17392742256872692),
        (0.33000947820757187, 0.3260725774312731),
        (0.6699905217924281, 0.3260725774312731),
        (0.9305681557970262, 0.17392742256872692),
    ),
}
"""Squared radii of rings, and the weights of rings."""

RINGS = (0, 0, 2, 3, 4)
"""Number of rings for each order of charges; 0 stands for the seven points."""


def _rule(rings: int) -> list[tuple[float, float, float]]:
    """Return the points x and y of the unit disk and their weights, whose sum is 1."""
    if rings == 0:
        radius = (2 / 3) ** 0.5
        return [(0.0, 0.0, 0.25)] + [
            (sign * radius * x, sign * radius * y, 0.125)
            for sign in (1, -1)
            for x, y in ((1.0, 0.0), (0.5, 0.75**0.5), (-0.5, 0.75**0.5))
        ]
    cosines = _COSINES[rings]
    corners = list(zip(cosines, reversed(cosines), strict=True))
    return [
        (x * square**0.5, y * square**0.5, weight / (4 * rings))
        for square, weight in _RINGS[rings]
        for cosine, sine in corners
        for x, y in ((cosine, sine), (-sine, cosine), (-cosine, -sine), (sine, -cosine))
    ]


_points = [_rule(rings) for rings in RINGS]
DISK_X, DISK_Y, DISK_WEIGHTS = np.array([point for rule in _points for point in rule]).T.copy()
DISK_STARTS = np.cumsum([0, *(len(rule) for rule in _points)])
"""Coordinates in the unit disk and weights of all orders, one after the other; where each starts,
and where the last one ends."""
