"""The disk by diffrax, and by a plain loop in JAX: prints trajectory-steps per second as JSON."""

import json
import os

# Before JAX is imported: one thread, as all others have.
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
os.environ["JAX_ENABLE_X64"] = "1"
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import diffrax  # pyright: ignore[reportMissingImports]
import jax  # pyright: ignore[reportMissingImports]
import jax.numpy as jnp  # pyright: ignore[reportMissingImports]
from clock import rate

SIGMA, FRICTION, NOISE, H = 0.5, 0.1, 5.0, 0.01
STEPS = 1000


def by_diffrax(solver, state0, terms_of):
    """A function of a key that takes one replica through STEPS steps."""

    def path(key):
        brownian = diffrax.UnsafeBrownianPath(shape=(), key=key)
        return diffrax.diffeqsolve(
            terms_of(brownian), solver, t0=0.0, t1=STEPS * H, dt0=H, y0=state0,
            saveat=diffrax.SaveAt(t1=True), adjoint=diffrax.DirectAdjoint(), max_steps=None,
        ).ys  # fmt: skip

    return path


def drift(t, y, args):
    x, theta, v, omega = y
    force = -FRICTION * (v + omega)
    return v, omega, force - jnp.cos(x), force / SIGMA


def diffusion(t, y, args):
    return 0.0, 0.0, NOISE, NOISE / SIGMA


def euler_maruyama(brownian):
    control = diffrax.ControlTerm(lambda t, y, args: jnp.array(diffusion(t, y, args)), brownian)
    term = diffrax.ODETerm(lambda t, y, args: jnp.stack(drift(t, y, args)))
    return diffrax.MultiTerm(term, control)
