"""Cost that an applied field, a coil and iron add to the forces of magnets."""

from functools import partial

import mujoco
from numba import njit, types

from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of
from magmotor.mjcf import memory
from magmotor.mjcf.callbacks import compiled_callback

COUNTS = (3, 10, 30, 300)
AT_MOST = {"uniform field": 1.05, "coil": 1.05, "a coil for each": 1.05, "switched off": 1.03}
"""Target ratios; the others have none."""

EVALUATIONS, TURNS = 1000, 100
NOTE = """\
Calls of the compiled callback for free magnets, without MuJoCo's own work, which takes several
  times as long and varies more than what is measured here. "Switched off" has all of it in the
  model, and a mark that names dipoles only."""

_callback = types.ExternalFunction("benchmark_callback", types.void(types.int64, types.int64))


@njit(nogil=True)
def _evaluate(count, model, data):
    for _ in range(count):
        _callback(model, data)


def main() -> None:
    bind()
    rows = []
    for count in COUNTS:
        custom = custom_of(count)
        cases = {name: partial(seconds, *model_of(count, text)) for name, text in custom.items()}
        everything = "".join(text for name, text in custom.items() if name != "coil")
        cases["switched off"] = partial(seconds, *model_of(count, everything, "dipoles"))
        times = in_turns(cases, TURNS)
        own = times.pop("nothing")
        rows += [
            Row(f"{count} magnets, {name}", found, own, AT_MOST.get(name))
            for name, found in times.items()
        ]
    show("Fields, coils and iron", NOTE, ("with it", "dipoles", "ratio"), rows)


def bind() -> None:
    """Bind the callback, which `seconds` calls, to its symbol."""
    memory.bind_compiled("benchmark_callback", compiled_callback())


def custom_of(count: int) -> dict[str, str]:
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


def model_of(count: int, custom: str, mark: str = "dipoles fields coils iron"):
    """Return a model of free magnets in a grid, and its data in motion."""
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
    data.time = 1.0  # at time 0, each call checks all indices, as the first step of a run does
    mujoco.mj_forward(model, data)
    return model, data


def seconds(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Return the seconds of a call of the callback."""
    count = max(1, EVALUATIONS // model.nbody)
    return seconds_of(partial(_evaluate, count, model._address, data._address)) / count
