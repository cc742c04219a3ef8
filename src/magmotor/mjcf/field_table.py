"""`tabulated_field`: the MJCF of a field that is known by its values on a grid."""

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arguments import checked
from magmotor.common.checks import check_array, check_integer
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.hints import numbers
from magmotor.numerics.cubic_convolution import FEWEST

Vector = Annotated[ArrayLike, numbers(3)]


@checked
def tabulated_field(
    field: Callable[[Any], Any],
    lower: Vector,
    upper: Vector,
    shape: tuple[int, int, int],
    *,
    name: str = "field",
) -> str:
    """Sample a field on a grid, and return it as MJCF for `<custom>`.

    Inside the grid, the field is interpolated by cubic convolution, with an error of third order in
    the spacing. The force on a dipole is the gradient of m.B of the interpolated field, so that
    energy is conserved although its divergence and curl vanish to second order only.

    Parameters
    ----------
    field : callable
        Magnetic flux density in T, shape (P, 3), at points in m, shape (P, 3), such as `getB` of an
        object of magpylib. It is called once, with all points.
    lower, upper : array_like, shape (3,)
        Corners of the grid in m, in the frame to which the field is fixed. It must contain all
        dipoles and all iron at any time.
    shape : tuple of int
        Numbers of nodes along x, y and z, each at least 4.
    name : str, default "field"
        Name of the numeric, which must start with `field`.

    Returns
    -------
    str
        `<numeric name="field" data="..."/>`. MuJoCo 3 crashes if it reads more than 500 numbers
        from XML; set those by `MjSpec.add_numeric` instead.

    Raises
    ------
    ValueError
        The name does not start with `field`, there are not three axes of 4 nodes or more, the
        corners are not in ascending order, or the field is not finite, has another shape, or raises
        an error.

    Examples
    --------
    >>> import magmotor as mm
    >>> text = mm.tabulated_field(lambda points: 0.1 * points, [0, 0, 0], [1, 1, 1], (4, 4, 4))
    >>> text[:52]
    '<numeric name="field" data="4 4 4 0.0 0.0 0.0 0.3333'
    """
    if not name.startswith("field") or not name.replace("_", "").isalnum():
        raise ArgumentError(
            "name", name, "must start with 'field' and have letters, digits and _ only"
        )
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    if not (low < high).all():
        raise ArgumentError("upper", upper, f"must be larger than lower = {lower} along each axis")
    if len(shape) != 3:
        raise ArgumentError("shape", shape, "must be the numbers of nodes along x, y and z")
    counts = [check_integer("shape", count, at_least=FEWEST) for count in shape]
    axes = (np.linspace(*ends) for ends in zip(low, high, counts, strict=True))
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    try:
        values = check_array("field(points)", field(points), len(points), 3)
    except (ValueError, TypeError, IndexError) as error:
        what = error if isinstance(error, InputError) else f"field(points) failed ({error})"
        once = "field is called once, with all points, and must return B at each"
        raise InputError(f"{what}; {once}, shape {points.shape}") from error
    spacing = (high - low) / (np.array(counts) - 1)
    numbers = [*counts, *low.tolist(), *spacing.tolist(), *values.ravel().tolist()]
    return f'<numeric name="{name}" data="{" ".join(map(repr, numbers))}"/>'
