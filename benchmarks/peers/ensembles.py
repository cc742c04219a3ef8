"""The disk's ensemble with the kernel and with other software: seconds per step of a replica.

The paper's disk with its own scheme, in batches of many replicas on one thread.
"""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial

import numpy as np
from numpy.typing import NDArray

import magmotor as mm
from benchmarks.harness.timing import in_turns, seconds_of
from benchmarks.peers import disk_numpy, disk_scalar
from benchmarks.peers.compiled_c import CDisk, NotBuilt
from benchmarks.peers.other_environment import Peer, Unavailable
from magmotor.devices.disk.variational import kernel, step_coefficients

SCENE, H, SEED = mm.Disk(), 0.01, 7
REPLICAS, STEPS = 4096, 2000
PART_SIZE = 256
"""Replicas per task of a thread, so that neither thread waits for the other at the end."""

PROGRAMS = ("disk_diffrax", "disk_torchsde")
NUMPY_REPLICAS = (4096, 16384, 65536)
Cases = dict[str, Callable[[], float]]


def by_kernel(
    scheme: str, steps: int = STEPS, threads: int = 1, scene: mm.Disk | mm.LangevinParticle = SCENE
) -> float:
    advance, coefficients = kernel(scene, scheme), step_coefficients(scene, scheme, H)

    def advance_part(first: int) -> None:
        advance(
            np.zeros((4, PART_SIZE)),
            np.empty((1, 4, PART_SIZE)),
            0,
            steps,
            SEED,
            first,
            1,
            0,
            coefficients,
        )

    with ThreadPoolExecutor(threads) as pool:
        run = partial(pool.map, advance_part, range(0, REPLICAS, PART_SIZE))
        return seconds_of(lambda: list(run())) / REPLICAS / steps


def by_numpy() -> Cases:
    """Use NumPy's default generator, and its fastest."""
    generators = {"NumPy": np.random.PCG64, "NumPy, SFC64": np.random.SFC64}
    cases: Cases = {}
    for name, bits in generators.items():
        rng = np.random.Generator(bits(SEED))
        runs = {n: partial(_vectorized, rng, n) for n in NUMPY_REPLICAS}
        times = in_turns(runs, turns=3)
        best = min(times, key=lambda n: min(times[n]))
        cases[f"{name} ({best})"] = runs[best]
    return cases


def _vectorized(rng: np.random.Generator, replicas: int) -> float:
    steps = 1_000_000 // replicas
    states = np.zeros((4, replicas))
    run = partial(disk_numpy.advance, states, steps, rng, SCENE, H)
    return seconds_of(run) / replicas / steps


def by_scalar_loop(replicas: int = 16, steps: int = 50_000) -> float:
    rng, states = np.random.default_rng(SEED), np.zeros((4, replicas))
    numbers = SCENE.sigma, SCENE.friction, SCENE.noise, H
    return seconds_of(partial(disk_scalar.advance, states, steps, rng, *numbers)) / replicas / steps


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
    states, coefficients = np.zeros((4, REPLICAS)), step_coefficients(SCENE, "euler", H)
    return seconds_of(partial(c.advance, states, STEPS, SEED, coefficients)) / REPLICAS / STEPS


def _check(c: CDisk) -> None:
    """Check that C and the kernel reach the same states after 100 steps."""
    coefficients = step_coefficients(SCENE, "euler", H)
    ours: NDArray[np.float64] = np.zeros((4, 256))
    theirs = ours.copy()
    kernel(SCENE, "euler")(ours, np.empty((1, 4, 256)), 0, 100, SEED, 0, 1, 0, coefficients)
    c.advance(theirs, 100, SEED, coefficients)
    difference = np.abs(ours - theirs).max()
    if not difference < 1e-9:
        raise AssertionError(f"after 100 steps C is {difference} from the kernel")


def by_other_environments(
    left_out: list[str], stack: ExitStack, programs: Iterable[str] = PROGRAMS
) -> Cases:
    cases: Cases = {}
    for program in programs:
        try:
            peer = Peer(program)
        except Unavailable as error:
            left_out.append(f"{program}, {error}")
            continue
        stack.callback(peer.close)
        for name, replicas in peer.replicas.items():
            cases[f"{name} ({replicas})"] = partial(peer.seconds, name)
    return cases
