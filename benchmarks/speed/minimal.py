"""The planar model compared with the plane model, and the savings of each omitted feature."""

from collections.abc import Callable, Iterator
from functools import partial

import mujoco

import magmotor as mm
from benchmarks.harness.stepping import Stepper
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns
from magmotor.run.in_mujoco import compose

SCENE = mm.Top()
DEFAULTS = mujoco.MjOption()
SOLVERS = ("PGS", "CG", "NEWTON")
SURFACES_NOTE = """\
Magnetized steps, MuJoCo's stopwatch off. With friction both models pay for finding, setting up and
  solving one frictional contact; without it the planar model has no contact."""
CHANGES_NOTE = """\
Bare steps of the planar top with friction, from one state in motion. A ratio above 1
  is the saving of omitting the feature; below 1, the possible saving if the top did not need it."""


def main() -> None:
    _surfaces()
    _changes()


def _surfaces() -> None:
    scenes = {
        (surface, friction): SCENE.replace(surface=surface, friction=friction)
        for friction in (SCENE.friction, 0.0)
        for surface in ("planar", "plane")
    }
    cases = {
        key: partial(Stepper(mm.build(scene)).seconds, magnetic=True)
        for key, scene in scenes.items()
    }
    times = in_turns(cases, turns=60)
    rows = [
        Row(f"friction {friction:g}", times["planar", friction], times["plane", friction], 0.7)
        for friction in (SCENE.friction, 0.0)
    ]
    show("The minimal model", SURFACES_NOTE, ("planar", "plane", "ratio"), rows)


def _changes() -> None:
    shipped = Stepper(mm.build(SCENE))
    cases: dict[str, Callable[[], float]] = {"shipped": partial(shipped.seconds, magnetic=False)}
    for name, model in _changed_models():
        cases[name] = partial(Stepper(model, start=shipped).seconds, magnetic=False)
    cases["MuJoCo's stopwatch"] = partial(shipped.seconds, magnetic=False, stopwatch_runs=True)
    times = in_turns(cases, turns=60)
    rows = [Row(name, times[name], times["shipped"]) for name in cases if name != "shipped"]
    show("One thing changed", CHANGES_NOTE, ("changed", "as shipped", "ratio"), rows)


def _changed_models() -> Iterator[tuple[str, mujoco.MjModel]]:
    plain = mm.build(SCENE)
    disabled = {
        name.removeprefix("mjDSBL_").lower(): int(bit)
        for name, bit in mujoco.mjtDisableBit.__members__.items()
        if name.startswith("mjDSBL_") and plain.opt.disableflags & int(bit)
    }
    for name, bit in disabled.items():
        yield f"flag {name} on", _enable(bit)
    yield "all these flags on", _enable(sum(disabled.values()))
    decorated = mm.build(SCENE, visual=True)
    decorated.opt.disableflags = plain.opt.disableflags
    yield "lights, cameras, decoration", decorated
    for solver in SOLVERS:
        yield f"solver {solver}", _solve_by(solver, mm.build(SCENE))
    sparse = mm.build(SCENE)
    sparse.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    yield "sparse Jacobian", sparse
    root = compose(SCENE, visual=False)
    ring = root.find("body", "ring")
    ring.mocap = None
    yield "ring fixed, not mocap", mujoco.MjModel.from_xml_string(root.to_xml_string())
    for site in list(ring.site):
        site.remove()
    yield "no dipole sites on the ring", mujoco.MjModel.from_xml_string(root.to_xml_string())
    yield "no contact (friction 0)", mm.build(SCENE.replace(friction=0.0))


def _enable(bits: int) -> mujoco.MjModel:
    model = mm.build(SCENE)
    model.opt.disableflags &= ~bits
    return model


def _solve_by(solver: str, model: mujoco.MjModel) -> mujoco.MjModel:
    """Solve with MuJoCo's own limits on iterations, nearly to rounding."""
    model.opt.solver = getattr(mujoco.mjtSolver, f"mjSOL_{solver}")
    model.opt.iterations, model.opt.ls_iterations = DEFAULTS.iterations, DEFAULTS.ls_iterations
    model.opt.tolerance = 1e-15
    return model
