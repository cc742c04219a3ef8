"""Our splittings against diffrax's third-order Langevin solvers, for a particle in -a cos x.

All follow the same Brownian paths: ours take the increments of `mm.noise.BrownianPath`, and diffrax
the same increments with the Levy areas, which are drawn from two more channels. The truth is
QUICSORT's at the shortest step.
"""

import math
import tempfile
from functools import partial
from pathlib import Path

import mujoco
import numpy as np

import magmotor as mm
from benchmarks.harness.machine import sign
from benchmarks.harness.records import Case, Record
from benchmarks.harness.tables import number, table
from benchmarks.harness.timing import seconds_of
from benchmarks.peers.ensembles import by_kernel
from benchmarks.peers.langevin import PARTICLE, exact, slide, with_error
from benchmarks.peers.langevin_estimates import mean
from benchmarks.peers.other_environment import answer_of
from magmotor.common import style
from magmotor.noise import BrownianPath

PHYSICS = {name: PARTICLE[name] for name in ("depth", "friction", "kT")}
SCENE = mm.LangevinParticle(
    friction=PHYSICS["friction"],
    noise=math.sqrt(2 * PHYSICS["friction"] * PHYSICS["kT"]),
    potential=((0.0, -PHYSICS["depth"]),),
)
FINEST, DURATION = 2.0**-9, 8.0
FACTORS = (8, 16, 32, 64, 128, 256, 512)
STEPS = tuple(factor * FINEST for factor in FACTORS)
WEAK_STEPS = (0.5, 0.75, 1.0, 1.5)
REPLICAS = {"strong": 256, "weak": 2048, "seconds": 1024}
WEAK_STEPS_TAKEN = 1000
OURS = ("variational/verlet", "variational/baoab")
THEIRS = ("ALIGN", "QUICSORT", "ShOULD")
EVALUATIONS = {"QUICSORT": 2, "ShOULD": 2}
"""Forces per step; the others need one."""

IN_MUJOCO, MUJOCO_STEPS = "mm.Langevin", 100_000
LOOKS = {
    **{name: style.method_look(name) for name in OURS},
    IN_MUJOCO: style.method_look("mujoco/baoab"),
    "ALIGN": {"color": style.PURPLE, "marker": ">"},
    "QUICSORT": {"color": style.GRAY, "marker": "<"},
    "ShOULD": {"color": style.INK, "marker": "^"},
}
VARIANCES = {0: 1.0, 1: 1 / 12, 2: 1 / 720}
"""Variances of W, H and K over the step, by the channels from which they are drawn."""


def cases(quick: bool) -> list[Case]:
    """Return the cases; none with --quick, since JAX compiles for a minute."""
    return [
        Case(f"peers/orders/{run.__name__}", partial(run, REPLICAS[run.__name__]), 40)
        for run in (strong, weak, seconds)
        if not quick
    ]


def strong(replicas: int) -> Record:
    """Return rms errors of x at the end by method, one for each step; the truth is diffrax's."""
    path, steps = BrownianPath(1, FINEST), round(DURATION / FINEST)
    fine = np.empty((3, replicas, steps))
    for channel, variance in VARIANCES.items():
        for replica in range(replicas):
            increments = path.increments(steps, replica=replica, channel=channel)
            fine[channel, replica] = math.sqrt(variance) * increments
    question = {**PHYSICS, "timestep": FINEST, "factors": [1, *FACTORS]}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "paths.npy")
        np.save(file, fine)
        answer = answer_of("langevin_diffrax", what="strong", file=str(file), **question)
        if "failed" in answer:
            return answer
        x = dict(zip(answer["solvers"], np.load(file)[:, :, 0], strict=True))
    truth, floor = x["QUICSORT"][0], x["ShOULD"][0]
    found = {name: [_rms(end - truth) for end in ends[1:]] for name, ends in x.items()}
    for method in OURS:
        found[method] = [_rms(_ends(method, path.coarsened(f), replicas) - truth) for f in FACTORS]
    found[IN_MUJOCO] = [_rms(_ends_in_mujoco(path.coarsened(f), replicas) - truth) for f in FACTORS]
    return {"errors": found, "floor": _rms(floor - truth)}


def _ends(method: str, path: BrownianPath, replicas: int):
    run = mm.simulate(
        SCENE, method=method, timestep=path.timestep, duration=DURATION, path=path,
        replicas=replicas, record_interval=round(DURATION / path.timestep), allow_unstable=True,
    )  # fmt: skip
    return run.x.values[:, -1]


def _ends_in_mujoco(path: BrownianPath, replicas: int):
    model = slide(PHYSICS["depth"], PHYSICS["friction"], path.timestep)
    steps = round(DURATION / path.timestep)
    langevin = mm.Langevin(model, kT=PHYSICS["kT"], path=path)
    run = langevin.sample(steps * langevin.timestep, replicas=replicas, record_interval=steps)
    return run.qpos.values[:, -1, 0]


def weak(replicas: int) -> Record:
    """Return the mean of cos x over the second half of a run, by method, one for each step."""
    found: dict[str, list[list[float]]] = {}
    for h in WEAK_STEPS:
        for method in OURS:
            run = mm.simulate(
                SCENE, method=method, timestep=h, duration=h * WEAK_STEPS_TAKEN, seed=3,
                replicas=replicas, allow_unstable=True,
            )  # fmt: skip
            cosines = np.cos(run.x.values[:, WEAK_STEPS_TAKEN // 2 + 1 :])
            found.setdefault(method, []).append(mean(cosines.mean(axis=1)))
        model, half = slide(PHYSICS["depth"], PHYSICS["friction"], h), WEAK_STEPS_TAKEN // 2
        langevin = mm.Langevin(model, kT=PHYSICS["kT"], seed=3)
        x = langevin.sample(
            half * langevin.timestep,
            replicas=replicas,
            burn_in=half * langevin.timestep,
        ).qpos.values[..., 0]
        found.setdefault(IN_MUJOCO, []).append(mean(np.cos(x).mean(axis=1)))
        question = {**PHYSICS, "timestep": h, "steps": WEAK_STEPS_TAKEN, "replicas": replicas}
        theirs = answer_of("langevin_diffrax", what="weak", **question, seed=4)
        if "failed" in theirs:
            return theirs
        for name, estimate in theirs.items():
            found.setdefault(name, []).append(estimate)
    return found


def seconds(replicas: int) -> Record:
    """Return the seconds per step of a replica, in batches on one thread."""
    question = {**PHYSICS, "timestep": 0.125, "replicas": replicas}
    theirs = answer_of("langevin_diffrax", what="seconds", **question)
    if "failed" in theirs:
        return theirs
    ours = {m: min(by_kernel(m.partition("/")[2], scene=SCENE) for _ in range(4)) for m in OURS}
    model = slide(PHYSICS["depth"], PHYSICS["friction"], 0.125)
    data, langevin = mujoco.MjData(model), mm.Langevin(model, kT=PHYSICS["kT"])
    step = partial(langevin.step, data, nstep=MUJOCO_STEPS)
    return {**theirs, **ours, IN_MUJOCO: min(seconds_of(step) for _ in range(4)) / MUJOCO_STEPS}


def tabulate(records: dict[str, Record]) -> str:
    found, bias, cost = _measured(records)
    shown = [FACTORS.index(f) for f in (16, 64, 256)]
    columns = ["a particle in a well", "forces a step", "ns a step", "strong order"]
    columns += [f"error at h = {STEPS[k]:g}" for k in shown]
    columns += [f"bias of cos x at h = {h:g}" for h in WEAK_STEPS]
    for record in (found, bias, cost):
        if "failed" in record:
            return table(columns, [[f"diffrax ({record['failed']})", *[""] * (len(columns) - 1)]])
    rows, truth = [], exact()["mean of cos x"]
    for name in LOOKS:
        errors, exponents = found["errors"][name], np.log(STEPS[:4])
        order = np.polyfit(exponents, np.log(errors[:4]), 1)[0]
        cells = [
            str(EVALUATIONS.get(name, 1)),
            f"{1e9 * cost[name]:.3g}",
            f"{order:.2f}",
            *(number(errors[k]) for k in shown),
        ]
        for value, error in 100 * np.array(bias[name]) / truth:
            cells.append(f"{with_error(value - 100, error)} %")
        rows.append([f"`{name}`", *cells])
    return table(columns, rows)


def draw(records: dict[str, Record], folder: Path) -> None:
    """Draw the strong error against the cost, and the bias of cos x against the step."""
    found, bias, cost = _measured(records)
    if any("failed" in record for record in (found, bias, cost)):
        return
    truth = exact()["mean of cos x"]
    with style.figure(10, 4.2) as figure:
        path, weakly = figure.subplots(1, 2)
        for name, look in LOOKS.items():
            marks = {**look, "label": name}
            path.loglog([1e9 * cost[name] / h for h in STEPS], found["errors"][name], **marks)
            value, error = 100 * np.array(bias[name]).T / truth
            steps = np.array(WEAK_STEPS) / EVALUATIONS.get(name, 1)
            weakly.errorbar(steps, value - 100, 2 * error, **marks)
        path.set(
            xlabel="ns per unit of time and replica", ylabel=f"rms error of x at t = {DURATION:g}"
        )
        path.set_title("On one Brownian path")
        weakly.set(xlabel="timestep per evaluation of the force", ylabel="%", ylim=(-15, 5))
        weakly.set_title("Bias of the mean of cos x")
        path.legend()
        sign(figure)
        figure.savefig(folder / "peers_langevin.png")


def _measured(records: dict[str, Record]) -> list[Record]:
    skipped = {"failed": "not measured with --quick"}
    return [records.get(f"peers/orders/{name}", skipped) for name in REPLICAS]


def _rms(values) -> float:
    return float(np.sqrt(np.mean(values**2)))
