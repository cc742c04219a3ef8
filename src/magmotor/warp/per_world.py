"""Numbers that may differ between worlds."""

from typing import Any

import numpy as np
import warp as wp

from magmotor.common.exceptions import ArgumentError


class PerWorld:
    """An attribute: a `wp.array` whose first dimension is 1 or the number of worlds.

    World w reads row w modulo the number of rows, as in arrays of a `mujoco_warp.Model`. What is
    assigned is such an array, or numbers that become one. All other dimensions, and the type, are
    those of the first array. A graph that was captured before keeps the old array: fill that.
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        return self if instance is None else instance.__dict__[self._name]

    def __set__(self, instance: Any, value: Any) -> None:
        before = instance.__dict__.get(self._name)
        if before is not None:
            if not isinstance(value, wp.array):
                value = self._array(value, before)
            shape = before.shape[1:]
            if value.dtype is not before.dtype or value.shape[1:] != shape or not value.shape[0]:
                raise self._error(value.shape, before)
        instance.__dict__[self._name] = value

    def _array(self, value: Any, before: Any) -> Any:
        """Return numbers as an array of the same type as the one before."""
        numbers = np.asarray(value)
        if not numbers.ndim or numbers.shape[1:] != _numbers_of_row(before):
            raise self._error(numbers.shape, before)
        return wp.array(numbers, dtype=before.dtype, ndim=before.ndim, device=before.device)

    def _error(self, shape: Any, before: Any) -> ArgumentError:
        dimensions = ", ".join(["1 or nworld", *map(str, _numbers_of_row(before))])
        kind = before.dtype.__name__
        return ArgumentError(
            f"shape of {self._name}", tuple(shape), f"must be ({dimensions}), of {kind}"
        )


def _numbers_of_row(array: Any) -> tuple[int, ...]:
    """Return the shape of a row as numbers, of which a vector has several."""
    return (*array.shape[1:], *getattr(array.dtype, "_shape_", ()))
