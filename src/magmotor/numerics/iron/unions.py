"""Unions of boxes whose edges are parallel: one grid for all of them, and the faces they leave bare.

Where boxes overlap, their volume counts once, and where they touch, they have no faces. What a
union is made of does not matter: a bar is the same bar if it is cut.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array
from magmotor.numerics.iron.meshes import cells_between, spaced

CLOSED = 1e-6
"""Gaps narrower than this, over the length of the whole, are none."""


class Rectangle(NamedTuple):
    """A rectangle of the surface.

    Attributes
    ----------
    axis, side : int
        The axis of its normal, and the sign of that.
    lower, upper : ndarray, shape (3,)
        Two of its corners, in m.
    """

    axis: int
    side: int
    lower: Array
    upper: Array

    @property
    def area(self) -> float:
        """The area in m^2."""
        return float(np.delete(self.upper - self.lower, self.axis).prod())


class Union:
    """A union of boxes.

    Parameters
    ----------
    half_edges, centers : ndarray, shape (N, 3)
        Half of the lengths of the boxes along x, y and z, and their centers, in m.
    """

    def __init__(self, half_edges: Array, centers: Array):
        lower, upper = centers - half_edges, centers + half_edges
        closed = CLOSED * np.ptp([lower.min(axis=0), upper.max(axis=0)], axis=0).max()
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

    def lines(self, spacing: float) -> list[Array]:
        """Return the coordinates of a grid along x, y and z, in m, denser beside edges."""
        return [spaced(lines, spacing) for lines in self._lines]

    def cells(self, spacing: float) -> Array:
        """Return the cells of the grid that are inside; see `meshes.box`."""
        lines, filled = self.lines(spacing), self._filled
        for axis in range(3):
            middle = (lines[axis][:-1] + lines[axis][1:]) / 2
            filled = filled.take(np.searchsorted(self._lines[axis], middle) - 1, axis=axis)
        return cells_between(lines)[filled.ravel()]

    def rectangles(self) -> list[Rectangle]:
        """Return the rectangles of which the surface consists, those in one plane in a row."""
        found = []
        for axis in range(3):
            filled = np.pad(np.moveaxis(self._filled, axis, 0), ((1, 1), (0, 0), (0, 0)))
            one, two = self._lines[:axis] + self._lines[axis + 1 :]
            for side, bare in ((-1, filled[1:] & ~filled[:-1]), (1, filled[:-1] & ~filled[1:])):
                for height, mask in zip(self._lines[axis], bare, strict=True):
                    for rows, columns in _blocks(mask.copy()):
                        ends = np.stack([one[rows], two[columns]], axis=1)
                        found.append(Rectangle(axis, side, *np.insert(ends, axis, height, axis=1)))
        return found


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
