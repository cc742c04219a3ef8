"""`recommend`: the cheapest method and timestep that reach a given error."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np

from magmotor.advice.measured_quantities import POSITIONS
from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Seconds, fraction
from magmotor.device.device import Scene
from magmotor.run import chart_data
from magmotor.run.chart_data import Curve, charted_scene, fit
from magmotor.run.measured import measured

ADAPTIVE, RECORDING = "scipy/dop853", 0.1
"""The method that chooses its own steps, and the default recording interval it is given (s)."""


Engines = Literal["mujoco", "any"]
"""The engines among whose methods one is chosen."""


@dataclass(frozen=True, kw_only=True)
class Recommendation:
    """A method and timestep with their expected error and cost.

    Attributes
    ----------
    method : str
    timestep : float
        In seconds; for the disk, dimensionless.
    quantity : str
        The quantity that `error` refers to.
    error : float
        Upper bound of the relative error, as measured on the charted scene (see `charted`).
    duration : float
        Length of the run in which `error` was measured, in units of `time_unit`.
    charted : str
        How the charted scene differs; then the error of this scene is unknown. Empty if it does not
        differ.
    seconds : float
        Wall time per simulated second (for the disk, per unit of time) on one core.
    machine : str
        The machine on which `seconds` was measured.
    time_unit : str
        "s", or "1" for the disk.
    basis : str
        What error and cost rest on: charts, with where and by which MuJoCo they were measured, or a
        measurement on this machine, with the element that errs most over its own range.
    uncharted : str
        What the scene also has, and whose error is unknown: the heat between the temperatures of a
        motor. Empty if there is none.
    """

    method: str
    timestep: float
    quantity: str
    error: float
    duration: float
    charted: str
    seconds: float
    machine: str
    time_unit: str
    basis: str
    uncharted: str = ""

    def __str__(self) -> str:
        """Return a one-line summary."""
        unit, each = ("", "unit of time") if self.time_unit == "1" else (" s", "simulated second")
        error = f"{100 * self.error:.2g} % over {self.duration:g}{unit or ' units of time'}"
        if self.charted:
            error = f"unknown for this scene ({error} for {self.charted})"
        unknown = f"; the error of {self.uncharted} is unknown" if self.uncharted else ""
        return (
            f"{self.method} at a timestep of {self.timestep:g}{unit}: error of {self.quantity}"
            f" {error}, {self.seconds:.2g} s per {each} ({self.basis}){unknown}"
        )


@checked
def recommend(
    scene: Scene,
    *,
    error: Annotated[float, fraction(above=0, below=1)] = 0.01,
    quantity: str | None = None,
    method: str | None = None,
    timestep: Seconds | None = None,
    engine: Engines = "mujoco",
    measure: bool = False,
) -> Recommendation:
    """Return the cheapest method and timestep that reach an error, as measured for the charts.

    The answer rests on charts, which are a file of this package and were measured once, on one
    machine and with one version of MuJoCo; `Recommendation.basis` names them. Errors hold on any
    machine; costs, and thus the choice among methods, may differ on yours. With `measure=True`,
    `advise` measures the motion of this very scene on this machine instead, which takes up to a
    minute.

    The charts cover the paper's top (case 4), motor and disk. For another scene of the same class,
    the charted timesteps are scaled so that none of its motions (swing in the stiffest well,
    friction; for the disk also thermal motion and flights) is resolved with fewer steps than in the
    charts, and are limited to stable ones. Errors and costs are not scaled: they are those of the
    charted scene in a run of the charted length. The error of another scene is unknown: an initial
    slip of 1 m/s makes it 41 times as large, and where symmetry keeps J zero it has no meaning.
    `Recommendation.charted` says how the charted scene differs. Nothing is recommended for a scene
    with dry friction, and nothing is promised of the heat that flows between the temperatures of a
    motor (`Recommendation.uncharted`). With drag, torsion, or a floor tilted by up to 10 mrad,
    MuJoCo's methods err at most three times as much as in the charts, also in a horizontal field of
    20 uT; the motor's errors hardly change. A top that is not balanced errs up to a hundred times
    as much and more: measure it.

    The error of each quantity, relative, in a run of `Recommendation.duration`:

    - `momentum_map`: the largest error of J over the largest J (60 s).
    - `position`: the final error over the largest distance from the ring's axis (20 s).
    - `path`: the final rms error, on the same noise, over the rms distance traveled (motor 20 s,
      disk 10).
    - `temperature`: the error of the mean over the last three quarters (motor 320 s, disk 160).
    - `diffusion`: the error of the growth of d's variance from t = 20 (disk 200).

    Parameters
    ----------
    scene : Top, Motor, Disk or LangevinParticle
        The scene to simulate.
    error : float
        Admissible relative error of the quantity on the charted scene, in (0, 1).
    quantity : str, optional
        The quantity whose error is limited: by default `momentum_map` for the top, otherwise
        `temperature`, or without noise the charted one of `position` and `path`.
    method : str, optional
        Consider only this method, whatever its engine.
    timestep : float, optional
        Consider only this timestep. If no method reaches the error at it, the most accurate one is
        returned.
    engine : str
        "mujoco": consider MuJoCo's methods only, unless the scene has none; "any": consider all.
    measure : bool
        Measure the errors of all positions of this scene, and of each over its own range, along a
        path of 20 s, by MuJoCo's integrators. The quantity, the timestep and the engine must then
        be left out. Temperatures, diffusion, `mujoco/baoab` and the methods of other engines are
        only in the charts.

    Returns
    -------
    Recommendation
        Its method is the adaptive `scipy/dop853` only if no other method reaches the error.

    Raises
    ------
    ValueError
        Bad input, or a scene, an error or a timestep that the charts do not cover; the message
        names the argument, its value and the bound.

    Examples
    --------
    >>> import magmotor as mm
    >>> choice = mm.recommend(mm.Top(), error=1e-4)
    >>> run = mm.simulate(mm.Top(), method=choice.method, timestep=choice.timestep, duration=60.0)
    """
    device = scene.device
    supported = device.methods(scene)
    if measure:
        _check_measured(quantity, timestep, engine)
        if method is not None:
            device.check_method(scene, method)
        found = measured(scene, error, (method,) if method else supported)
        return Recommendation(
            quantity=POSITIONS, charted="", machine="this machine", time_unit=device.time_unit,
            uncharted=device.uncharted(scene), **found._asdict(),
        )  # fmt: skip
    device.check_charted(scene)
    considered = _methods_of("any" if method else engine, supported)
    hint = "" if considered == supported else "; engine = 'any' considers other engines, too"
    if method is not None:
        device.check_method(scene, method)
    curves = _charted_curves(scene, considered, hint)
    if quantity is None:
        quantity = next(
            name for name in (*scene.device.quantities(scene), *curves) if name in curves
        )
    check_choice("quantity", quantity, tuple(curves))
    choices = curves[quantity]
    if method is not None:
        if method not in choices:
            raise ArgumentError(
                "method", method, f"must be a method charted for {quantity}: {', '.join(choices)}"
            )
        choices = {method: choices[method]}
    fitted = {name: fit(scene, name, curve) for name, curve in choices.items()}
    points = [*_points(fitted, timestep)]
    if not points:
        longest = max(curve.steps[-1] for curve in fitted.values())
        raise ArgumentError(
            "timestep", timestep, f"must be at most {longest:g}, the longest in the charts{hint}"
        )
    longest_within = {point.method: point for point in points if point.error <= error}
    best = min(points, key=lambda point: point.error)
    if longest_within:
        best = min(longest_within.values(), key=lambda p: (p.method == ADAPTIVE, p.seconds))
    elif timestep is None:
        smallest = float(f"{1.005 * best.error:.2e}")
        bound = f"at least {smallest:g}, the smallest charted for {quantity} ({best.method}"
        raise ArgumentError(
            "error", error, f"must be {bound} at a timestep of {best.timestep:g}){hint}"
        )
    data = chart_data.load()
    return Recommendation(
        quantity=quantity,
        duration=data["durations"][type(charted_scene(scene)).__name__][quantity],
        charted=_difference(scene),
        machine=data["machine"],
        time_unit=device.time_unit,
        basis=chart_data.basis(),
        uncharted=device.uncharted(scene),
        **best._asdict(),
    )


class _Point(NamedTuple):
    method: str
    timestep: float
    error: float
    seconds: float


def _check_measured(quantity: str | None, timestep: float | None, engine: Engines) -> None:
    """Check what a measurement does not choose among."""
    given = {"quantity": quantity, "timestep": timestep}
    for name, value in given.items():
        if value is not None:
            raise ArgumentError(name, value, "must be left out if measure = True")
    if engine != "mujoco":
        raise ArgumentError("engine", engine, "must be 'mujoco' if measure = True")


def _methods_of(engine: Engines, supported: tuple[str, ...]) -> tuple[str, ...]:
    """Return MuJoCo's methods, or all if there are none of MuJoCo or any engine is wanted."""
    in_mujoco = tuple(method for method in supported if method.startswith("mujoco/"))
    return in_mujoco if in_mujoco and engine == "mujoco" else supported


def _difference(scene: Scene) -> str:
    """Return how the charted scene differs from this one, in words."""
    charted = charted_scene(scene)
    kind = f"a {type(charted).__name__}"
    if type(charted) is not type(scene):
        return kind
    values = vars(scene).items()
    names = [k for k, value in values if k != "surface" and value != getattr(charted, k)]
    return f"{kind} with another {', '.join(names)}" if names else ""


def _charted_curves(
    scene: Scene, considered: tuple[str, ...], hint: str
) -> dict[str, dict[str, Curve]]:
    """Return the curves of the scene's class and surface by quantity and method."""
    kind = type(charted_scene(scene)).__name__
    surface = getattr(scene, "surface", "planar")
    found = chart_data.curves(kind, surface, considered)
    if not found:
        sentence = f"the charts have no {kind} on this surface: pass a method and a timestep"
        raise ArgumentError("surface", surface, f"{sentence} to simulate{hint}")
    return found


def _points(curves: Mapping[str, Curve], timestep: float | None) -> Iterator[_Point]:
    """Yield all points; at a given timestep, the error of the next longer one and its own cost."""
    for method, curve in curves.items():
        for step, expected, seconds in zip(*map(np.ndarray.tolist, curve), strict=True):
            if method == ADAPTIVE:
                yield _Point(method, timestep or RECORDING, expected, seconds)
            elif timestep is None:
                yield _Point(method, step, expected, seconds)
            elif step >= timestep * (1 - 1e-9):
                yield _Point(method, timestep, expected, seconds * step / timestep)
                break
