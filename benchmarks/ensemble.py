"""The sliding disk's ensemble against NumPy, compiled loops, C, diffrax and torchsde."""

import textwrap
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial

import numpy as np
from compiled_c import FLAGS, CDisk, NotBuilt
from numpy.typing import NDArray
from other_environment import NotThere, Peer
from peers import disk_numpy, disk_scalar
from table import Row, in_turns, show

import magmotor as mm
from magmotor.devices.disk.reference import kernel, law

SCENE, H, SEED = mm.Disk(), 0.01, 7
REPLICAS, STEPS = 4096, 2000
LONG = 10 * STEPS
"""So that two threads meet seldom."""
PART = 256
"""Replicas that a thread takes at a time, so that neither waits for the other in the end."""

DURATION = 1000.0
"""Of mm.ensemble, which takes some 50 ms for each call and more for each record."""

PROGRAMS = ("disk_diffrax.py", "disk_torchsde.py")
NUMPY_REPLICAS = (4096, 16384, 65536)
TARGETS = {
    "NumPy": 12.0,
    "compiled scalar loop": 10.0,
    "diffrax": 40.0,
    "torchsde": 40.0,
    "C, the same algorithm": 0.8,
}
Cases = dict[str, Callable[[], float]]


def main() -> None:
    _against_others()
    _own_costs()


def _against_others() -> None:
    left_out: list[str] = []
    with ExitStack() as stack:
        cases = {"kernel": partial(by_kernel, "euler")}
        cases |= by_numpy() | {"compiled scalar loop": by_scalar_loop} | by_c(left_out)
        cases |= elsewhere(left_out, stack)
        for case in cases.values():
            case()
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
    for case in quick.values():
        case()
    _ensemble(threads=1, duration=10.0)
    times = in_turns(quick, turns=10)
    slow: Cases = {
        "the kernel": partial(by_kernel, "euler", LONG),
        "mm.ensemble": partial(_ensemble, 1),
        "mm.ensemble, two threads": partial(_ensemble, 2),
    }
    times |= in_turns(slow, turns=5)
    one, two = times["mm.ensemble"], times["mm.ensemble, two threads"]
    cores = max(_cores(quick["euler, two threads"]) for _ in range(10))
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


def by_kernel(scheme: str, steps: int = STEPS, threads: int = 1) -> float:
    advance, rule = kernel(SCENE, scheme), law(SCENE, scheme, H)

    def work(first: int) -> None:
        advance(np.zeros((4, PART)), np.empty((1, 4, PART)), 0, steps, SEED, first, 1, 0, rule)

    with ThreadPoolExecutor(threads) as pool:
        begin = time.perf_counter()
        list(pool.map(work, range(0, REPLICAS, PART)))
        return (time.perf_counter() - begin) / REPLICAS / steps


def _ensemble(threads: int, duration: float = DURATION) -> float:
    begin = time.perf_counter()
    mm.ensemble(
        SCENE, method="variational/euler", timestep=H, duration=duration, replicas=REPLICAS,
        seed=SEED, threads=threads,
    )  # fmt: skip
    return (time.perf_counter() - begin) / REPLICAS / round(duration / H)


def by_numpy() -> Cases:
    """With the generator that NumPy gives by default, and with its fastest."""
    generators = {"NumPy": np.random.PCG64, "NumPy, SFC64": np.random.SFC64}
    cases: Cases = {}
    for name, bits in generators.items():
        rng = np.random.Generator(bits(SEED))
        runs = {n: partial(_vectorised, rng, n) for n in NUMPY_REPLICAS}
        times = in_turns(runs, turns=3)
        best = min(times, key=lambda n: min(times[n]))
        cases[f"{name} ({best})"] = runs[best]
    return cases


def _vectorised(rng: np.random.Generator, replicas: int) -> float:
    steps = 1_000_000 // replicas
    states = np.zeros((4, replicas))
    begin = time.perf_counter()
    disk_numpy.advance(states, steps, rng, SCENE, H)
    return (time.perf_counter() - begin) / replicas / steps


def by_scalar_loop(replicas: int = 16, steps: int = 50_000) -> float:
    rng, states = np.random.default_rng(SEED), np.zeros((4, replicas))
    begin = time.perf_counter()
    disk_scalar.advance(states, steps, rng, SCENE.sigma, SCENE.friction, SCENE.noise, H)
    return (time.perf_counter() - begin) / replicas / steps


def by_c(left_out: list[str]) -> Cases:
    try:
        same, other = CDisk(), CDisk("XOSHIRO")
    except NotBuilt as error:
        left_out.append(f"C, {error}")
        return {}
    _check(same)
    return {
        "C, the same algorithm": partial(_compiled, same),
        "C, xoshiro256++": partial(_compiled, other),
    }


def _compiled(c: CDisk) -> float:
    states, rule = np.zeros((4, REPLICAS)), law(SCENE, "euler", H)
    begin = time.perf_counter()
    c.advance(states, STEPS, SEED, rule)
    return (time.perf_counter() - begin) / REPLICAS / STEPS


def _check(c: CDisk) -> None:
    """After 100 steps C and the kernel are at the same states."""
    rule = law(SCENE, "euler", H)
    ours: NDArray[np.float64] = np.zeros((4, 256))
    theirs = ours.copy()
    kernel(SCENE, "euler")(ours, np.empty((1, 4, 256)), 0, 100, SEED, 0, 1, 0, rule)
    c.advance(theirs, 100, SEED, rule)
    apart = np.abs(ours - theirs).max()
    if not apart < 1e-9:
        raise AssertionError(f"after 100 steps C is {apart} from the kernel")


def elsewhere(left_out: list[str], stack: ExitStack, programs: Iterable[str] = PROGRAMS) -> Cases:
    cases: Cases = {}
    for program in programs:
        try:
            peer = Peer(program)
        except NotThere as error:
            left_out.append(f"{program}, {error}")
            continue
        stack.callback(peer.close)
        for name, replicas in peer.replicas.items():
            cases[f"{name} ({replicas})"] = partial(peer.seconds, name)
    return cases


def _listed(parts: Iterable[str]) -> str:
    return textwrap.fill(", ".join(parts) + ".", 98, initial_indent="  ", subsequent_indent="  ")


def _cores(run: Callable[[], float]) -> float:
    wall, processor = time.perf_counter(), time.process_time()
    run()
    return (time.process_time() - processor) / (time.perf_counter() - wall)


if __name__ == "__main__":
    main()
