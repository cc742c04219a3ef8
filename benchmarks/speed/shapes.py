"""Cost of magnets by their geom: far away, as dipoles, and in contact."""

from functools import partial

import mujoco

from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns
from benchmarks.speed.fields import bind, seconds

TURNS = 100
ALLOWED = {"two disks that touch": 10e-6, "ten disks that touch": 50e-6}
"""Largest times in s."""

NOTE = """\
Calls of the compiled callback for free disks of 12.7 x 3.175 mm, without MuJoCo's own work. Where
  magnets touch, the time is compared with the largest that is allowed. "Switched off" has
  polarizations of geoms, and a mark that names dipoles only."""


def main() -> None:
    bind()
    dipoles, shapes = _elements(by_geom=False), _elements(by_geom=True)
    far = [(0.3 * (k % 10), 0.3 * (k // 10), 0.0) for k in range(100)]
    stacks = {f"{name} disks that touch": count for name, count in (("two", 2), ("ten", 10))}
    cases = {
        "dipoles": partial(seconds, *_model(far, dipoles, "dipoles")),
        "100 far magnets": partial(seconds, *_model(far, shapes, "magnets")),
        "switched off": partial(seconds, *_model(far, dipoles + shapes, "dipoles")),
    } | {
        name: partial(seconds, *_model(_stack(count), shapes, "magnets"))
        for name, count in stacks.items()
    }
    times = in_turns(cases, TURNS)
    rows = [
        Row("100 far magnets, by geom", times["100 far magnets"], times["dipoles"], 1.05),
        Row("100 far magnets, switched off", times["switched off"], times["dipoles"], 1.03),
    ] + [Row(name, times[name], TURNS * [ALLOWED[name]], 1.0) for name in stacks]
    show("Magnets by their geom", NOTE, ("with them", "dipoles or allowed", "ratio"), rows)


def _stack(count: int) -> list[tuple[float, float, float]]:
    """Return the places of disks on one another."""
    return [(0.0, 0.0, 3.175e-3 * k) for k in range(count)]


def _elements(*, by_geom: bool) -> str:
    """Return a disk as MJCF, without its polarization if a dipole represents it."""
    if by_geom:
        return '<geom type="cylinder" size=".00635 .0015875" user="0 0 1.32"/>'
    return '<geom type="cylinder" size=".00635 .0015875"/><site user="0.4225"/>'


def _model(places: list[tuple[float, float, float]], inside: str, mark: str):
    """Return a model of free bodies, and its data."""
    bodies = "".join(f'<body pos="{x} {y} {z}"><freejoint/>{inside}</body>' for x, y, z in places)
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option gravity="0 0 0"><flag contact="disable"/></option>
      <custom><text name="magmotor" data="{mark}"/></custom>
      <worldbody>{bodies}</worldbody>
    </mujoco>""")
    data = mujoco.MjData(model)
    data.time = 1.0  # at time 0, each call checks all indices, as the first step of a run does
    mujoco.mj_forward(model, data)
    return model, data
