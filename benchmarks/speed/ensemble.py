"""The sliding disk's ensemble compared with NumPy, compiled loops, C, diffrax and torchsde."""

import textwrap
from collections.abc import Iterable
from contextlib import ExitStack
from functools import partial

import magmotor as mm
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import cores_of, in_turns, seconds_of
from benchmarks.peers.compiled_c import FLAGS
from benchmarks.peers.ensembles import (
    REPLICAS,
    SCENE,
    SEED,
    STEPS,
    Cases,
    H,
    by_c,
    by_kernel,
    by_numpy,
    by_other_environments,
    by_scalar_loop,
)

LONG = 10 * STEPS
"""So many that two threads rarely wait for each other."""

DURATION = 1000.0
"""Duration of mm.ensemble, which takes about 50 ms per call and more per record."""

TARGETS = {
    "NumPy": 12.0,
    "compiled scalar loop": 10.0,
    "diffrax": 40.0,
    "torchsde": 40.0,
    "C, the same algorithm": 0.8,
}


def main() -> None:
    _against_others()
    _own_costs()


def _against_others() -> None:
    left_out: list[str] = []
    with ExitStack() as stack:
        cases = {"kernel": partial(by_kernel, "euler")}
        cases |= by_numpy() | {"compiled scalar loop": by_scalar_loop} | by_c(left_out)
        cases |= by_other_environments(left_out, stack)
        times = in_turns(cases, turns=15)
    rows = [
        Row(name, times[name], times["kernel"], at_least=TARGETS.get(name.split(" (")[0]))
        for name in cases
        if name != "kernel"
    ]
    note = f"""\
One step of one replica of the paper's disk, scheme euler, h = 0.01, in float64 on one thread; in
  brackets the replicas of the fastest batch. diffrax: its Euler, UnsafeBrownianPath, jit, vmap.
  torchsde: its euler, BrownianInterval(dt=h), no gradients. C is checked to give the kernel's
  paths, and built with {" ".join(FLAGS)};
  its noise of xoshiro256++ costs less, but has a state and an order.
  Million trajectory-steps/s:
{_listed(f"{name} {1e-6 / min(times[name]):.3g}" for name in cases)}"""
    for reason in left_out:
        note += f"\n  Left out: {reason}."
    show("The ensemble kernel against others", note, ("other", "kernel", "ratio"), rows)


def _own_costs() -> None:
    quick: Cases = {
        "euler": partial(by_kernel, "euler", LONG),
        "baoab": partial(by_kernel, "baoab", LONG),
        "euler, two threads": partial(by_kernel, "euler", LONG, threads=2),
    }
    times = in_turns(quick, turns=10)
    slow: Cases = {
        "the kernel": partial(by_kernel, "euler", LONG),
        "mm.ensemble": partial(_ensemble, 1),
        "mm.ensemble, two threads": partial(_ensemble, 2),
    }
    times |= in_turns(slow, turns=5)
    one, two = times["mm.ensemble"], times["mm.ensemble, two threads"]
    cores = max(cores_of(quick["euler, two threads"]) for _ in range(10))
    rows = [
        Row("kernel, one thread over two", times["euler"], times["euler, two threads"], None, 1.8),
        Row("mm.ensemble, one thread over two", one, two),
        Row("mm.ensemble over the kernel", one, times["the kernel"]),
        Row("kernel, baoab over euler", times["baoab"], times["euler"]),
    ]
    note = f"""\
{REPLICAS} replicas; mm.ensemble runs to t = {DURATION:g} and samples its statistics each 100 steps.
  The target is for two idle cores: of this machine's the two threads got {cores:.1f}.
  Million trajectory-steps/s:
{_listed(f"{name} {1e-6 / min(times[name]):.3g}" for name in times)}"""
    show("The ensemble's own costs", note, ("first", "second", "ratio"), rows)


def _ensemble(threads: int) -> float:
    run = partial(
        mm.ensemble, SCENE, method="variational/euler", timestep=H, duration=DURATION,
        replicas=REPLICAS, seed=SEED, threads=threads,
    )  # fmt: skip
    return seconds_of(run) / REPLICAS / round(DURATION / H)


def _listed(parts: Iterable[str]) -> str:
    return textwrap.fill(", ".join(parts) + ".", 98, initial_indent="  ", subsequent_indent="  ")
