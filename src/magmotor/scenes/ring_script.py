"""The ring's script: its height and tilt as functions of time."""

import math
from bisect import bisect_right
from typing import NamedTuple

from magmotor.checks import check_number, reject


class Waypoint(NamedTuple):
    """Where the ring is at one time; between two waypoints it moves smoothly, at rest at both."""

    time: float
    height: float
    tilt: float


def pose(script: tuple[Waypoint, ...], time: float) -> tuple[float, float]:
    """Height (m) and tilt (rad) at a time; before the first waypoint and after the last, constant.

    The interpolation is 6 s^5 - 15 s^4 + 10 s^3: velocity and acceleration are continuous.
    """
    after = bisect_right(script, time, key=lambda waypoint: waypoint.time)
    if after == 0 or after == len(script):
        _, height, tilt = script[0 if after == 0 else -1]
        return height, tilt
    start, end = script[after - 1], script[after]
    s = (time - start.time) / (end.time - start.time)
    s = s**3 * (10 + s * (6 * s - 15))
    return (
        start.height + s * (end.height - start.height),
        start.tilt + s * (end.tilt - start.tilt),
    )


def check_script(script: tuple[Waypoint, ...], lowest: float) -> tuple[Waypoint, ...]:
    """Return the script as waypoints.

    Raises
    ------
    ValueError
        Times that do not increase, a height not above `lowest`, a tilt outside [0, pi/2).
    """
    if not isinstance(script, tuple | list):
        raise reject("ring_script", script, "a tuple of waypoints")
    checked: list[Waypoint] = []
    for i, entry in enumerate(script):
        name = f"ring_script[{i}]"
        if not isinstance(entry, tuple | list) or len(entry) != 3:
            raise reject(name, entry, "three numbers: time, height, tilt")
        time, height, tilt = entry
        waypoint = Waypoint(
            check_number(f"{name}.time", time, unit="s"),
            check_number(f"{name}.height", height, above=lowest, unit="m"),
            check_number(f"{name}.tilt", tilt, at_least=0.0, below=math.pi / 2, unit="rad"),
        )
        if checked and waypoint.time <= checked[-1].time:
            raise reject(f"{name}.time", time, f"greater than {checked[-1].time:g} s")
        checked.append(waypoint)
    return tuple(checked)
