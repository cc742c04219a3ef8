"""Cost of magnets by their geom: far away, as dipoles, and in contact."""

from functools import partial

import mujoco
import numpy as np

from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns
from benchmarks.speed.fields import bind, seconds
from magmotor.common.arrays import Array

TURNS = 100
ALLOWED = {
    "two disks that touch": 10e-6,
    "ten disks that touch": 50e-6,
    "two capsules that touch": 25e-6,
    "two meshes of 12 faces": 60e-6,
    "two meshes of 100 faces": 600e-6,
}
"""Largest times in s."""

BLOCK = np.array([[x, y, z] for x in (-6, 6) for y in (-4, 4) for z in (-3, 3)]) * 1e-3

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
    cases |= {name: partial(seconds, *_oblique(name)) for name in ALLOWED if name not in stacks}
    times = in_turns(cases, TURNS)
    rows = [
        Row("100 far magnets, by geom", times["100 far magnets"], times["dipoles"], 1.05),
        Row("100 far magnets, switched off", times["switched off"], times["dipoles"], 1.03),
    ] + [Row(name, times[name], TURNS * [ALLOWED[name]], 1.0) for name in ALLOWED]
    show("Magnets by their geom", NOTE, ("with them", "dipoles or allowed", "ratio"), rows)


def _stack(count: int) -> list[tuple[float, float, float]]:
    """Return the places of disks on one another."""
    return [(0.0, 0.0, 3.175e-3 * k) for k in range(count)]


def _elements(*, by_geom: bool) -> str:
    """Return a disk as MJCF, without its polarization if a dipole represents it."""
    if by_geom:
        return '<geom type="cylinder" size=".00635 .0015875" user="0 0 1.32"/>'
    return '<geom type="cylinder" size=".00635 .0015875"/><site user="0.4225"/>'


def _oblique(name: str):
    """Return two magnets that touch, a model and its data; their polarization is oblique."""
    if "capsules" in name:
        geom = '<geom type="capsule" size=".004 .003" user=".2 .3 1.2"/>'
        return _model([(0.0, 0.0, 0.0), (0.008, 0.0, 0.0)], geom, "magnets")
    vertices, place = (BLOCK, (0.001, 0.0, 0.006)) if "12" in name else (_ball(52), (0, 0, 0.01))
    geom = '<geom type="mesh" mesh="hull" user=".2 .3 1.2"/>'
    return _model([(0.0, 0.0, 0.0), place], geom, "magnets", vertices)


def _ball(count: int) -> Array:
    """Return points that are spread over a sphere, whose hull has 2 count - 4 faces."""
    z, angle = 1 - (2 * np.arange(count) + 1) / count, np.pi * (1 + 5**0.5) * np.arange(count)
    r = np.sqrt(1 - z * z)
    return 0.005 * np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def _model(
    places: list[tuple[float, float, float]], inside: str, mark: str, vertices: Array | None = None
):
    """Return a model of free bodies, and its data; `vertices` are those of a mesh."""
    asset = ""
    if vertices is not None:
        numbers = " ".join(map(str, vertices.ravel().tolist()))
        asset = f'<asset><mesh name="hull" vertex="{numbers}"/></asset>'
    bodies = "".join(f'<body pos="{x} {y} {z}"><freejoint/>{inside}</body>' for x, y, z in places)
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option gravity="0 0 0"><flag contact="disable"/></option>
      <custom><text name="magmotor" data="{mark}"/></custom>
      {asset}
      <worldbody>{bodies}</worldbody>
    </mujoco>""")
    data = mujoco.MjData(model)
    data.time = 1.0  # at time 0, each call checks all indices, as the first step of a run does
    mujoco.mj_forward(model, data)
    return model, data
