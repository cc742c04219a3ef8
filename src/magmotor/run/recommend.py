"""`recommend`: the cheapest method and timestep that reach a given error."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Literal

from magmotor.advice.points import Point, reaching
from magmotor.advice.recommendation import Recommendation
from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Seconds, fraction
from magmotor.device.device import Scene
from magmotor.run import chart_data
from magmotor.run.chart_data import charted_scene, fit
from magmotor.run.measured import measured

Engines = Literal["mujoco", "any"]
"""The engines among whose methods one is chosen."""


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

    The error of each quantity, relative, in a run up to `Recommendation.horizon`:

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
        return measured(scene, error, (method,) if method else supported)
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
    fitted = [fit(scene, curve) for curve in choices.values()]
    points = [point for curve in fitted for point in _at(timestep, curve)]
    if not points:
        longest = max(curve[-1].timestep for curve in fitted)
        raise ArgumentError(
            "timestep", timestep, f"must be at most {longest:g}, the longest in the charts{hint}"
        )
    best = min(points, key=lambda point: point.error)
    if within := reaching(points, error):
        best = within[0]
    elif timestep is None:
        smallest = float(f"{1.005 * best.error:.2e}")
        bound = f"at least {smallest:g}, the smallest charted for {quantity} ({best.method}"
        raise ArgumentError(
            "error", error, f"must be {bound} at a timestep of {best.timestep:g}){hint}"
        )
    return Recommendation(
        quantity=quantity, error=error, method=best.method, timestep=best.timestep,
        promised=best.error, seconds=best.seconds, basis=chart_data.basis(),
        horizon=chart_data.load()["durations"][type(charted_scene(scene)).__name__][quantity],
        charted=_difference(scene), uncharted=device.uncharted(scene), time_unit=device.time_unit,
    )  # fmt: skip


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
) -> dict[str, dict[str, list[Point]]]:
    """Return the curves of the scene's class and surface by quantity and method."""
    kind = type(charted_scene(scene)).__name__
    surface = getattr(scene, "surface", "planar")
    found = chart_data.curves(kind, surface, considered)
    if not found:
        sentence = f"the charts have no {kind} on this surface: pass a method and a timestep"
        raise ArgumentError("surface", surface, f"{sentence} to simulate{hint}")
    return found


def _at(timestep: float | None, curve: list[Point]) -> Iterator[Point]:
    """Yield all points; at a given timestep, the error of the next longer one and its own cost."""
    if timestep is None:
        yield from curve
        return
    for point in curve:
        if point.timestep >= timestep * (1 - 1e-9):
            seconds = point.seconds * point.timestep / timestep
            yield replace(point, timestep=timestep, seconds=seconds)
            return
