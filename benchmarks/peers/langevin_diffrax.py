"""A particle in a periodic potential with diffrax's solvers of underdamped Langevin equations.

ALIGN is of second strong order and needs the first space-time Levy area (H) of the Brownian path
beside its increments (W). QUICSORT and ShOULD are of third order and need the second (K), too.
"""

import os
import time

os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"  # read by JAX when it is imported
os.environ["JAX_ENABLE_X64"] = "1"
os.environ["JAX_PLATFORMS"] = "cpu"
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import diffrax  # pyright: ignore[reportMissingImports]
import jax  # pyright: ignore[reportMissingImports]
import jax.numpy as jnp  # pyright: ignore[reportMissingImports]
import numpy as np
from langevin_estimates import coarse_areas, mean

SOLVERS = {"ALIGN": diffrax.ALIGN, "QUICSORT": diffrax.QUICSORT, "ShOULD": diffrax.ShOULD}
AREAS = dict.fromkeys(SOLVERS, diffrax.SpaceTimeTimeLevyArea)
AREAS["ALIGN"] = diffrax.SpaceTimeLevyArea
TIMED_STEPS = 1000


class Given(diffrax.AbstractBrownianPath):
    """A path whose increments and areas over the steps are given."""

    W: jax.Array
    H: jax.Array
    K: jax.Array
    timestep: float
    levy_area = diffrax.SpaceTimeTimeLevyArea

    @property
    def t0(self):
        return 0.0

    @property
    def t1(self):
        return self.timestep * len(self.W)

    def evaluate(self, t0, t1=None, left=True, use_levy=False):
        step = jnp.round(t0 / self.timestep).astype(int)
        values = self.W[step], self.H[step], self.K[step]
        return self.levy_area(jnp.asarray(t1 - t0), *values) if use_levy else values[0]


def answer(what, **question):
    return {"strong": strong, "weak": weak, "seconds": seconds}[what](**question)


def strong(file, depth, friction, kT, timestep, factors):
    """Return the final states on given paths, as a file of shape (solvers, factors, 2, replicas).

    The input file contains W, H and K of each step of each replica, of shape (3, replicas, steps).
    """
    fine = np.load(file)
    found = np.empty((len(SOLVERS), len(factors), 2, fine.shape[1]))
    for column, factor in enumerate(factors):
        areas, h = coarse_areas(fine, timestep, factor), factor * timestep
        for row, solver in enumerate(SOLVERS.values()):

            def run(W, H, K, solver=solver, h=h):
                return solve(solver(), Given(W, H, K, h), h, len(W), depth, friction, kT)

            found[row, column] = np.array(jax.jit(jax.vmap(run))(*areas))[..., -1]
    np.save(file, found)
    return {"solvers": [*SOLVERS]}


def weak(depth, friction, kT, timestep, steps, replicas, seed):
    """Estimate the mean of cos x over the second half of the steps."""
    found = {}
    for name in SOLVERS:
        run = _sampler(name, timestep, steps, depth, friction, kT, steps // 2)
        x, _ = jax.jit(jax.vmap(run))(jax.random.split(jax.random.key(seed), replicas))
        found[name] = mean(np.cos(x).mean(axis=1))
    return found


def seconds(depth, friction, kT, timestep, replicas):
    """Return the seconds per step of a replica, in a batch on one thread."""
    found, keys = {}, jax.random.split(jax.random.key(0), replicas)
    for name in SOLVERS:
        sampler = _sampler(name, timestep, TIMED_STEPS, depth, friction, kT, 1)
        run = jax.jit(jax.vmap(sampler))
        jax.block_until_ready(run(keys))  # the first run compiles
        times = []
        for _ in range(3):
            begin = time.perf_counter()
            jax.block_until_ready(run(keys))
            times.append(time.perf_counter() - begin)
        found[name] = min(times) / replicas / TIMED_STEPS
    return found


def _sampler(name, h, steps, depth, friction, kT, records):
    def run(key):
        path = diffrax.UnsafeBrownianPath((), key, levy_area=AREAS[name])
        return solve(SOLVERS[name](), path, h, steps, depth, friction, kT, records)

    return run


def solve(solver, path, h, steps, depth, friction, kT, records=None):
    """Return x and v at the end, or at the last records, one per step."""
    terms = diffrax.MultiTerm(
        diffrax.UnderdampedLangevinDriftTerm(friction, kT, lambda x, _: depth / kT * jnp.sin(x)),
        diffrax.UnderdampedLangevinDiffusionTerm(friction, kT, path),
    )
    times = None if records is None else h * jnp.arange(steps - records + 1, steps + 1)
    return diffrax.diffeqsolve(
        terms, solver, t0=0.0, t1=h * steps, dt0=h, y0=(jnp.array(0.0), jnp.array(0.0)),
        saveat=diffrax.SaveAt(t1=records is None, ts=times), adjoint=diffrax.ForwardMode(),
        max_steps=None,
    ).ys  # fmt: skip
