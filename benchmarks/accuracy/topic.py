"""Speed against accuracy: every method of every scene at many steps, and the cheapest of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.accuracy import cost, diffusion, dry_friction, other_scenes, paths, top, trees
from benchmarks.accuracy.panels import Mark, Panel, draw_panels
from benchmarks.accuracy.points import points_of
from benchmarks.accuracy.scenes import DISK, MOTOR, SCENES
from benchmarks.accuracy.tables import tabulate
from benchmarks.harness.machine import machine, versions
from benchmarks.harness.records import Case, Record
from magmotor.devices.motor.theory import euler_slip_overheating
from magmotor.theory import euler_slip_variance, gibbs_mean_squares

PARTS = (cost, top, paths, diffusion, other_scenes, dry_friction, trees)


def _disk_overheating(timestep: float) -> float:
    return euler_slip_variance(DISK, timestep) / gibbs_mean_squares(DISK)["slip"] - 1


def _motor_overheating(timestep: float) -> float:
    return euler_slip_overheating(MOTOR, timestep) - 1


DEFAULT = Mark("mujoco/euler", 1 / 500, "MuJoCo's default")
SPIN = Panel("top", "momentum_map", "Top, case 4: J over 60 s", mark=DEFAULT)
HEAT = Panel("motor", "temperature", "Motor: temperature of slip and ring", _motor_overheating)
FLIGHT = Panel("disk", "diffusion", "Disk: diffusion of d at three deviations")
PICTURES = {
    "speed_accuracy": ([SPIN, HEAT, FLIGHT], 3),
    "speed_accuracy_top": (
        [
            SPIN,
            Panel("top", "momentum_map_20", "Top, case 4: J at 20 s"),
            Panel("top", "position", "Top, case 4: position at 20 s"),
            Panel("top on a plane", "momentum_map", "Case 4 on a plane: J over 60 s"),
            Panel("free top", "position", "Without friction, case 2: position at 20 s"),
            Panel("free top", "energy", "Case 2: energy kept over 500 s"),
            Panel("free top", "momentum_map", "Case 2: J kept over 500 s"),
            Panel("top on a plane", "position", "Case 4 on a plane: position at 20 s"),
        ],
        4,
    ),
    "speed_accuracy_disk": (
        [
            Panel("disk", "path", "Disk: x at t = 10 along a Brownian path"),
            Panel("disk", "temperature", "Disk: slip's temperature", _disk_overheating),
            FLIGHT,
        ],
        3,
    ),
    "speed_accuracy_motor": (
        [
            Panel("motor", "path", "Motor: position at 20 s along a Brownian path"),
            Panel("motor", "slip_path", "Motor: slip at 20 s along a Brownian path"),
            Panel("motor", "ring_path", "Motor: ring's axis at 20 s along a Brownian path"),
            Panel("motor", "slip_temperature", "Motor: slip's temperature", _motor_overheating),
            Panel("motor", "ring_temperature", "Motor: ring's temperature"),
            HEAT,
        ],
        3,
    ),
}  # fmt: skip
"""Panels of each picture, and number of columns."""

NOTE = (
    "Lower left is better; the broad line joins the best of the stable. Filled: MuJoCo. Crosses at"
    " the right: failed, or off by more than 100 %.\nGray, and points with arrows: at most twice"
    " the standard error of sampling. Errors below 1e-10 are drawn there."
)

OF_TOP = {"momentum_map": top.DURATIONS["top"], "position": top.COMPARED_AT}
OF_NOISY = {
    name: {"path": length * paths.STRONG / paths.RECORDS, "temperature": length}
    for name, length in paths.DURATIONS.items()
}
FRONT: Mapping[str, Mapping[str, float]] = {
    "top": OF_TOP,
    "top on a plane": OF_TOP,
    "disk": {**OF_NOISY["disk"], "diffusion": diffusion.DURATION},
    "motor": OF_NOISY["motor"],
}
"""Length of the runs for each quantity that `magmotor.recommend` supports, by charted scene."""


def cases(quick: bool) -> list[Case]:
    """Return all cases."""
    return [case for part in PARTS for case in part.cases(quick)]


def draw(records: Mapping[str, Record], folder: Path) -> None:
    """Draw all pictures."""
    points = points_of(records)
    for name, (panels, columns) in PICTURES.items():
        draw_panels(points, panels, columns, folder / f"{name}.png", NOTE)


def tables(records: Mapping[str, Record]) -> dict[str, str]:
    """Return all tables, in Markdown."""
    return {**tabulate(records), **trees.tables(records)}


def front(records: Mapping[str, Record]) -> dict[str, Any]:
    """Return the data of `magmotor.recommend`: the points that did not fail."""
    found = []
    for point in points_of(records):
        stepping = point.method != "scipy/dop853"
        supported = point.quantity in FRONT.get(point.scene, ())
        if supported and point.error < float("inf") and stepping:
            scene = SCENES[point.scene].scene
            found.append({
                "scene": type(scene).__name__, "surface": scene.surface,
                "quantity": point.quantity, "method": point.method, "timestep": point.timestep,
                "error": point.error, "floor": point.floor, "seconds": point.seconds,
            })  # fmt: skip
    durations = {type(SCENES[name].scene).__name__: lengths for name, lengths in FRONT.items()}
    head = {"machine": machine(), "versions": versions(), "durations": durations}
    return {**head, "points": found}
