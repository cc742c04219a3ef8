"""Cost that a given field, a coil and iron add to the forces of magnets."""

from functools import partial

import mujoco

import magmotor as mm
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of

COUNTS = (3, 10, 30, 300)
AT_MOST = {"uniform field": 1.05, "coil": 1.05, "a coil for each": 1.05, "switched off": 1.03}
"""Target ratios; the others have none."""

STEPS, TURNS = 200, 40
NOTE = """\
Evaluations of all forces of free magnets on one another, by `mj_forward` with magnetism less those
  without, compared with magnets alone. "Switched off" has all of it in the model, and a mark that
  names dipoles only."""


def main() -> None:
    rows = []
    for count in COUNTS:
        custom = _custom(count)
        cases = {name: partial(_seconds, *_model(count, text)) for name, text in custom.items()}
        everything = "".join(text for name, text in custom.items() if name != "coil")
        cases["switched off"] = partial(_seconds, *_model(count, everything, "dipoles"))
        cases["bare"] = partial(_seconds, *_model(count, ""), magnetic=False)
        times = in_turns(cases, TURNS)
        bare = min(times["bare"])
        own = [each - bare for each in times["nothing"]]
        rows += [
            Row(f"{count} magnets, {name}", [each - bare for each in times[name]], own,
                AT_MOST.get(name))
            for name in cases if name not in ("bare", "nothing")
        ]  # fmt: skip
    show("Fields, coils and iron", NOTE, ("with it", "dipoles", "ratio"), rows)


def _custom(count: int) -> dict[str, str]:
    """Return what each case adds to the magnets."""
    coils = [
        f'<tuple name="coil_{k}"><element objtype="actuator" objname="u{k}"/>'
        f'<element objtype="site" objname="s{k}"/></tuple>'
        for k in range(count)
    ]
    return {
        "nothing": "",
        "uniform field": '<numeric name="field" data="1e-4 2e-4 3e-4"/>',
        "coil": coils[0],
        "a coil for each": "".join(coils),
        "field with a gradient": '<numeric name="field_2" data="1e-4 2e-4 3e-4 1 0 0 0 0"/>',
        "one piece of iron": (
            '<numeric name="soft" data="1000"/><tuple name="iron">'
            '<element objtype="numeric" objname="soft"/>'
            '<element objtype="geom" objname="g0"/></tuple>'
        ),
    }


def _model(count: int, custom: str, mark: str = "dipoles fields coils iron"):
    side = round(count ** (1 / 3) + 0.5)
    places = [(k % side / 10, k // side % side / 10, k // side**2 / 10) for k in range(count)]
    bodies = "".join(
        f'<body pos="{x} {y} {z}"><freejoint/><geom name="g{k}" size="0.01" pos="0.02 0 0"/>'
        f'<site name="s{k}" user="0.1"/></body>'
        for k, (x, y, z) in enumerate(places)
    )
    actuators = "".join(f'<general name="u{k}" site="s{k}" gainprm="0"/>' for k in range(count))
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option gravity="0 0 0"><flag contact="disable"/></option>
      <custom><text name="magmotor" data="{mark}"/>{custom}</custom>
      <worldbody>{bodies}</worldbody>
      <actuator>{actuators}</actuator>
    </mujoco>""")
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    return model, data


def _seconds(model: mujoco.MjModel, data: mujoco.MjData, *, magnetic: bool = True) -> float:
    call = partial(mujoco.mj_forward, model, data)
    if not magnetic:
        return seconds_of(call, STEPS)
    with mm.magnetism():
        return seconds_of(call, STEPS)
