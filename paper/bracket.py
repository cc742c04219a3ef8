"""Bracket a threshold between two values."""

from collections.abc import Callable


def bracket(
    condition: Callable[[float], bool], first: float, last: float, ratio: float
) -> tuple[float, float]:
    """Bisect logarithmically between a value that satisfies a condition and one that does not.

    Parameters
    ----------
    condition : callable
        The condition, as a function of a positive value.
    first, last : float
        It holds at `first` and fails at `last`; either may be the larger.
    ratio : float
        Largest ratio of the two values that are returned.

    Returns
    -------
    tuple of float
        A value at which the condition holds, and one at which it fails.

    Raises
    ------
    ValueError
        The condition does not hold at `first`, or holds at `last`.
    """
    for name, value, expected in (("first", first, True), ("last", last, False)):
        if condition(value) != expected:
            verb = "hold" if expected else "fail"
            raise ValueError(f"{name} = {value:g}: the condition must {verb} there")
    while max(first, last) / min(first, last) > ratio:
        middle = (first * last) ** 0.5
        first, last = (middle, last) if condition(middle) else (first, middle)
    return first, last
