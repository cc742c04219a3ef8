"""Unions of boxes whose edges are parallel: one grid for all of them, and the faces left bare.

Where boxes overlap, their volume counts once, and where they touch, they have no faces. What a
union is made of does not matter: a bar is the same bar if it is cut. Cylinders on one axis are
boxes of radii, angles and heights.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array


class Rectangle(NamedTuple):
    """A rectangle of the surface.

    Attributes
    ----------
    axis, side : int
        The axis of its normal, and the sign of that.
    lower, upper : ndarray, shape (3,)
        Two of its corners.
    risen : ndarray, shape (2, 3)
        Whether the piece rises above the rectangle at the lower and the upper edges along the axes.
    free : ndarray, shape (2, 3)
        Whether the piece ends at these edges.
    """

    axis: int
    side: int
    lower: Array
    upper: Array
    risen: Array
    free: Array


class Union:
    """A union of boxes.

    Parameters
    ----------
    lower, upper : ndarray, shape (N, 3)
        Two corners of each of the boxes.
    closed : float
        Gaps narrower than this are none.
    """

    def __init__(self, lower: Array, upper: Array, closed: float):
        self._lines, inside = [], []
        for axis in range(3):
            lines = np.unique([lower[:, axis], upper[:, axis]])
            lines = lines[np.diff(lines, prepend=-np.inf) > closed]
            middle = (lines[:-1] + lines[1:]) / 2
            self._lines.append(lines)
            inside.append((middle > lower[:, axis, None]) & (middle < upper[:, axis, None]))
        self._filled = np.einsum("ni,nj,nk->ijk", *inside)
        for axis in range(3):
            others = tuple({0, 1, 2} - {axis})
            kept = np.diff(self._filled, axis=axis).any(axis=others)
            kept = np.concatenate([[True], kept, [True]])
            self._lines[axis] = self._lines[axis][kept]
            self._filled = self._filled.compress(kept[:-1], axis=axis)

    @property
    def is_box(self) -> bool:
        """Whether the union is a box."""
        return bool(self._filled.all())

    @property
    def edges(self) -> list[Array]:
        """Coordinates along the axes between which the union does not change."""
        return self._lines

    def inside(self, lines: list[Array]) -> NDArray[np.bool_]:
        """Return which cells of a grid are inside, in the order of `meshes.cells_between`.

        The edges must be among the coordinates of its lines.
        """
        filled = self._filled
        for axis, (line, edges) in enumerate(zip(lines, self._lines, strict=True)):
            place = np.searchsorted(edges, (line[:-1] + line[1:]) / 2) - 1
            filled = filled.take(place, axis=axis)
        return filled.ravel()

    def rectangles(self) -> list[Rectangle]:
        """Return the rectangles of which the surface consists, those in one plane in a row."""
        found = []
        for axis in range(3):
            filled = np.pad(np.moveaxis(self._filled, axis, 0), ((1, 1), (0, 0), (0, 0)))
            one, two = self._lines[:axis] + self._lines[axis + 1 :]
            for side, below, above in ((-1, filled[1:], filled[:-1]), (1, filled[:-1], filled[1:])):
                for height, own, over in zip(self._lines[axis], below, above, strict=True):
                    for i, k in _blocks(own & ~over):
                        ends = np.stack([one[i], two[k]], axis=1)
                        risen, free = (
                            np.insert(_everywhere_beside(mask, *i, *k), axis, False, axis=1)
                            for mask in (np.pad(over, 1), ~np.pad(own | over, 1))
                        )
                        lower, upper = np.insert(ends, axis, height, axis=1)
                        found.append(Rectangle(axis, side, lower, upper, risen, free))
        return found


def _everywhere_beside(mask: Array, i: int, j: int, k: int, m: int) -> Array:
    """Return whether a mask is true in all neighbors at the edges of a rectangle, (2, 2).

    It consists of the cells from i to j and from k to m, and there is one more cell on all sides.
    """
    rows, columns = slice(i + 1, j + 1), slice(k + 1, m + 1)
    sides = [[mask[i, columns], mask[rows, k]], [mask[j + 1, columns], mask[rows, m + 1]]]
    return np.array([[bool(side.all()) for side in both] for both in sides])


def _blocks(mask: Array) -> Iterator[tuple[list[int], list[int]]]:
    """Yield the first and the last lines, along both axes, of rectangles that fill a mask.

    The mask is cleared.
    """
    while mask.any():
        row, column = (int(k) for k in np.argwhere(mask)[0])
        width = int(np.argmin(np.append(mask[row, column:], False)))
        across = slice(column, column + width)
        height = int(np.argmin(np.append(mask[row:, across].all(axis=1), False)))
        mask[row : row + height, across] = False
        yield [row, row + height], [column, column + width]
