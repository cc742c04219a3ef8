"""Cost of iron by its geom: a disk near a bar, in contact with a block, and two balls of iron."""

from functools import partial

import mujoco

from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns
from benchmarks.speed.fields import bind, seconds

TURNS = 100
ALLOWED = {
    "a disk 5 mm from a bar": 20e-6,
    "a disk in contact with a block": 50e-6,
    "two balls of iron in a field": 500e-6,
}
"""Largest times in s."""

DISK = '<body pos="0 0 {}"><freejoint/><geom type="cylinder" size=".00635 .0015875" {}/></body>'
POLARIZED = 'user="0 0 1.32"'
BAR = '<geom name="one" type="box" size=".005 .005 .03"/>'
BLOCK = '<geom name="one" type="box" size=".03 .03 .01"/>'
BALL = '<body pos="0 0 {}"><freejoint/><geom name="{}" size=".01"/></body>'

NOTE = """\
Calls of the compiled callback, without MuJoCo's own work; the time is compared with the largest
  that is allowed. "Switched off" is a bar and two dipoles whose mark names dipoles only."""


def main() -> None:
    bind()
    dipoles = "".join(
        DISK.format(height, "").replace("/></body>", '/><site user=".4"/></body>')
        for height in (0.04, 0.06)
    )
    cases = {
        "dipoles": partial(seconds, *_model(dipoles, "dipoles", "")),
        "switched off": partial(seconds, *_model(BAR + dipoles, "dipoles")),
        "a disk 5 mm from a bar": partial(
            seconds, *_model(BAR + DISK.format(0.0365875, POLARIZED), "magnets iron")
        ),
        "a disk in contact with a block": partial(
            seconds, *_model(BLOCK + DISK.format(0.0115875, POLARIZED), "magnets iron")
        ),
        "two balls of iron in a field": partial(
            seconds,
            *_model(BALL.format(0, "one") + BALL.format(0.025, "two"), "fields iron", "one two"),
        ),
    }
    times = in_turns(cases, TURNS)
    rows = [Row("switched off", times["switched off"], times["dipoles"], 1.03)]
    rows += [Row(name, times[name], TURNS * [ALLOWED[name]], 1.0) for name in ALLOWED]
    show("Iron by its geom", NOTE, ("with it", "dipoles or allowed", "ratio"), rows)


def _model(bodies: str, mark: str, pieces: str = "one"):
    """Return a model in which geoms are iron, and its data."""
    elements = "".join(f'<element objtype="geom" objname="{each}"/>' for each in pieces.split())
    iron = f"""
      <numeric name="steel" data="1000"/><numeric name="field" data="0 0 .02"/>
      <tuple name="iron"><element objtype="numeric" objname="steel"/>{elements}</tuple>"""
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option gravity="0 0 0"><flag contact="disable"/></option>
      <custom><text name="magmotor" data="{mark}"/>{iron if pieces else ""}</custom>
      <worldbody>{bodies}</worldbody>
    </mujoco>""")
    data = mujoco.MjData(model)
    data.time = 1.0  # at time 0, each call checks all indices, as the first step of a run does
    mujoco.mj_forward(model, data)
    return model, data
