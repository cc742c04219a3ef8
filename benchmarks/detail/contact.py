"""Cost and effect of the contact's parameters: MuJoCo's, ours, and combinations of both.

The scene is the top on the plane. Contacts that keep the viscous law are recalibrated after each
change.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import mujoco
import numpy as np

import magmotor as mm
from benchmarks.detail.flight import DEFAULT_TIMESTEP, RK4, fly, momentum_error, plain_top
from benchmarks.harness.records import Case, Record
from benchmarks.harness.stepping import cost
from benchmarks.harness.tables import cost_cells, number, table
from magmotor.mjcf.viscous_contact import resistance, viscous_contacts
from magmotor.run.in_mujoco import compose

SCENE = mm.Top.paper(4)
PLANE = SCENE.replace(surface="plane")
MOBILITY = 1 / SCENE.ball_mass + SCENE.ball_radius**2 / SCENE.inertia[0]
SLIP = 0.03
"""Initial slip, in m/s, of the decay; the largest in the fourth case is 0.035."""


def ours(scene: mm.Top = PLANE, pair: dict[str, Any] | None = None, **options: Any):
    """Build our model with other options and contact attributes, recalibrated."""
    root = compose(scene, visual=False)
    root.option.set_attributes(**options)
    root.find("contact", "viscous").set_attributes(**(pair or {}))
    model = mujoco.MjModel.from_xml_string(root.to_xml_string())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    (touching,) = viscous_contacts(data)  # not `calibrate`, which rejects what is measured here
    model.pair_solreffriction[:] = 0.0, -scene.friction * resistance(data, touching, MOBILITY)
    return model


def _edited(scene: mm.Top, **fields: Any) -> mujoco.MjModel:
    """Build our model with other numbers, not recalibrated."""
    model = mm.build(scene)
    for name, value in fields.items():
        getattr(model, name)[:] = value
    return model


DEFAULT_SOLIMP, DEFAULT_FRICTION = [0.9, 0.95, 0.001, 0.5, 2], [1, 1, 0.005, 0.0001, 0.0001]
SOLVERS = {"iterations": 100, "ls_iterations": 50}
PARTS: dict[str, Callable[[], mujoco.MjModel]] = {
    "ours": ours,
    "MuJoCo's defaults": partial(plain_top, SCENE),
    "defaults, elliptic cone": partial(plain_top, SCENE, 'cone="elliptic"'),
    "defaults, elliptic cone, impratio 100": partial(
        plain_top, SCENE, 'cone="elliptic" impratio="100"'
    ),
    "defaults, five times as stiff": partial(plain_top, SCENE, "", 'solref="0.004 1"'),
    "defaults, slide friction 0.01": partial(plain_top, SCENE, "", 'friction="0.01"'),
    "ours, solreffriction as in the defaults": partial(_edited, PLANE, pair_solreffriction=0.0),
    "ours, friction coefficients as in the defaults": partial(
        _edited, PLANE, pair_friction=DEFAULT_FRICTION
    ),
    "ours, without a margin": partial(_edited, PLANE, pair_margin=0.0),
    "ours, pyramidal cone": partial(ours, cone="pyramidal"),
    "ours, impratio 1": partial(ours, impratio=1.0),
    "ours, impratio 1e-4": partial(ours, impratio=1e-4),
    "ours, impratio 1e-8": partial(ours, impratio=1e-8),
    "ours, solimp as in the defaults": partial(ours, pair={"solimp": DEFAULT_SOLIMP}),
    "ours, normal's solref as in the defaults": partial(ours, pair={"solref": [0.02, 1]}),
    "ours, solver's tolerance 1e-8": partial(ours, tolerance=1e-8),
    "ours, one iteration of the solver": partial(ours, iterations=1),
    "ours, exact line search": partial(ours, ls_tolerance=0.01),
    "ours, conjugate gradients": partial(ours, solver="CG"),
    "planar, one step of conjugate gradients": partial(ours, SCENE),
    "planar, Newton": partial(ours, SCENE, solver="Newton", tolerance=1e-15, **SOLVERS),
    "planar, impratio 1": partial(ours, SCENE, impratio=1.0),
    "planar, without a margin": partial(_edited, SCENE, pair_margin=0.0),
}


def cases(quick: bool) -> list[Case]:
    turns = 10 if quick else 60
    return [Case(f"detail/contact/{name}", partial(_measure, name, turns), 1.5) for name in PARTS]


def _measure(name: str, turns: int) -> Record:
    model = PARTS[name]()
    record = cost(model, mm.build(PLANE), turns) | {"slip": slip_time(model, SLIP)}
    try:
        with mm.magnetism():
            flight = fly(model, SCENE)
    except ArithmeticError as failure:
        return record | {"failed": str(failure)}
    largest = float(np.abs(flight.momentum).max())
    return record | {"momentum": momentum_error(flight.momentum, SCENE), "largest": largest}


def slip_time(model: mujoco.MjModel, slip: float) -> float | None:
    """Return the seconds until a slip (m/s) decays to 1/e, without magnetism; None after 2 s."""
    model.opt.timestep, model.opt.integrator = DEFAULT_TIMESTEP, RK4
    data = mujoco.MjData(model)
    data.qvel[0] = before = slip
    for n in range(1, 1000):
        mujoco.mj_step(model, data)
        after = data.qvel[0] - SCENE.ball_radius * data.qvel[-2]
        if after < slip / math.e:
            within = (before - slip / math.e) / (before - after)
            return float(n - 1 + within) * DEFAULT_TIMESTEP
        before = after
    return None


def tabulate(records: dict[str, Record]) -> str:
    columns = ["contact", "µs a step", "ratio", "slip to 1/e (s)", "error of J, 60 s"]
    rows = []
    for name in PARTS:
        record = records[f"detail/contact/{name}"]
        error = record.get("failed") or number(record["momentum"])
        rows.append([name, *cost_cells(record), number(record["slip"]) or "never", error])
    law = number(1 / mm.theory.slip_relaxation_rate(SCENE))
    return table(columns, [["*the paper's law*", "", "", law, "0"], *rows])
