"""A variable of a dataset."""

from typing import NamedTuple

from numpy.typing import NDArray


class Column(NamedTuple):
    """Dimensions, values, unit and description of a variable."""

    dimensions: tuple[str, ...]
    values: NDArray
    unit: str
    label: str
