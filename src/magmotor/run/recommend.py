"""`recommend`: which method, at which timestep, reaches an error cheapest."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice, reject
from magmotor.common.hints import Seconds, number
from magmotor.device.device import Scene
from magmotor.run import charts
from magmotor.run.charts import Curve, charted_scene, fit

Array = NDArray[np.float64]


ADAPTIVE, RECORDING = "scipy/dop853", 0.1
"""The method that chooses its own steps; its timestep is that of recording, by default this."""


@dataclass(frozen=True, kw_only=True)
class Recommendation:
    """A method and timestep, and what the charts let one expect of them."""

    method: str
    timestep: float
    """In seconds; of the disk dimensionless."""
    quantity: str
    """What `error` is of."""
    error: float
    """At the most, relative."""
    seconds: float
    """Wall time of a simulated second (of the disk: unit of time) on one core."""
    machine: str
    """Where `seconds` was measured."""
    time_unit: str

    def __str__(self) -> str:
        """One line for people."""
        unit, each = ("", "unit of time") if self.time_unit == "1" else (" s", "simulated second")
        return (
            f"{self.method} at a timestep of {self.timestep:g}{unit}: error of {self.quantity}"
            f" {100 * self.error:.2g} %, {self.seconds:.2g} s a {each} (on {self.machine})"
        )


@checked
def recommend(
    scene: Scene,
    *,
    error: Annotated[float, number(above=0, below=1)] = 0.01,
    quantity: str | None = None,
    method: str | None = None,
    timestep: Seconds | None = None,
) -> Recommendation:
    """The cheapest method and timestep that reach an error, as measured by `make charts`.

    The charts show the paper's top (case 4), motor and disk. For another scene of the same kind
    their steps are scaled, so that none of its motions (swing in the stiffest well, friction; of
    the disk thermal motion and flights) is followed with fewer steps than there, and are never
    longer than is stable. Errors and costs stay those of the charts: they hold for runs
    about as long as the charted ones, of scenes about as large.

    Parameters
    ----------
    scene : Top, Motor, Disk or LangevinParticle
        What is to be simulated.
    error : float
        Relative error of the quantity, in (0, 1).
    quantity : str, optional
        What is to have that error: by default `momentum_map` of the top, of the others
        `temperature`, or without noise the charted one of `position` and `path`.
    method : str, optional
        Look at this one only.
    timestep : float, optional
        Look at this one only; where no method reaches the error at it, the most accurate is chosen.

    Returns
    -------
    Recommendation
        With the adaptive `scipy/dop853` only where no other method reaches the error.

    Raises
    ------
    ValueError
        Bad input; a scene, an error or a timestep that the charts do not reach: names it, its value
        and the bound.

    Examples
    --------
    >>> import magmotor as mm
    >>> choice = mm.recommend(mm.Top(), error=1e-4)
    >>> run = mm.simulate(mm.Top(), method=choice.method, timestep=choice.timestep, duration=60.0)
    """
    device = scene.device
    known = device.methods(scene)
    if method is not None:
        check_choice("method", method, known)
    curves = _charted_curves(scene, known)
    if quantity is None:
        quantity = next(
            name for name in (*scene.device.quantities(scene), *curves) if name in curves
        )
    check_choice("quantity", quantity, tuple(curves))
    choices = curves[quantity]
    if method is not None:
        if method not in choices:
            raise reject(
                "method", method, f"must be one charted for {quantity}: {', '.join(choices)}"
            )
        choices = {method: choices[method]}
    fitted = {name: fit(scene, name, curve) for name, curve in choices.items()}
    points = [*_points(fitted, timestep)]
    if not points:
        longest = max(curve.steps[-1] for curve in fitted.values())
        raise reject(
            "timestep", timestep, f"must be at most {longest:g}, the longest that the charts bear"
        )
    longest_within = {point.method: point for point in points if point.error <= error}
    best = min(points, key=lambda point: point.error)
    if longest_within:
        best = min(longest_within.values(), key=lambda p: (p.method == ADAPTIVE, p.seconds))
    elif timestep is None:
        smallest = float(f"{1.005 * best.error:.2e}")
        bound = f"at least {smallest:g}, the least charted for {quantity}, by {best.method}"
        raise reject("error", error, f"must be {bound} at a timestep of {best.timestep:g}")
    machine = charts.load()["machine"]
    return Recommendation(
        quantity=quantity, machine=machine, time_unit=device.time_unit, **best._asdict()
    )


class _Point(NamedTuple):
    method: str
    timestep: float
    error: float
    seconds: float


def _charted_curves(scene: Scene, known: tuple[str, ...]) -> dict[str, dict[str, Curve]]:
    """What the charts show of the scene's kind and surface, by quantity and method."""
    kind = type(charted_scene(scene)).__name__
    surface = getattr(scene, "surface", "planar")
    found = charts.curves(kind, surface, known)
    if not found:
        sentence = (
            f"must be one charted for a {kind}; on this one give simulate a method and a timestep"
        )
        raise reject("surface", surface, sentence)
    return found


def _points(curves: Mapping[str, Curve], timestep: float | None) -> Iterator[_Point]:
    """All points, or at a given timestep those of the next longer steps, at its cost."""
    for method, curve in curves.items():
        for step, expected, seconds in zip(*map(np.ndarray.tolist, curve), strict=True):
            if method == ADAPTIVE:
                yield _Point(method, timestep or RECORDING, expected, seconds)
            elif timestep is None:
                yield _Point(method, step, expected, seconds)
            elif step >= timestep * (1 - 1e-9):
                yield _Point(method, timestep, expected, seconds * step / timestep)
                break
