"""Brackets of a threshold: between which two values a condition ceases to hold."""

from collections.abc import Callable


def bracket(
    holds: Callable[[float], bool], first: float, last: float, ratio: float
) -> tuple[float, float]:
    """Halve, in the logarithm, the way from where a condition holds to where it does not.

    Parameters
    ----------
    holds : callable
        The condition, at a positive value.
    first, last : float
        It holds at `first`, and at `last` it does not; either may be the larger.
    ratio : float
        How near the two come, larger over smaller.

    Returns
    -------
    tuple of float
        A value at which the condition was seen to hold, and one at which it was seen not to.

    Raises
    ------
    ValueError
        The condition does not hold at `first`, or holds at `last`.
    """
    for name, value, expected in (("first", first, True), ("last", last, False)):
        if holds(value) != expected:
            condition = "hold" if expected else "fail"
            raise ValueError(f"{name} = {value:g}: the condition must {condition} there")
    while max(first, last) / min(first, last) > ratio:
        middle = (first * last) ** 0.5
        first, last = (middle, last) if holds(middle) else (first, middle)
    return first, last
