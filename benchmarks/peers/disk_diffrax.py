"""The disk with diffrax, and with a plain loop in JAX, on one thread."""

import os
from functools import cache

# JAX reads these when it is imported; its thread pool has one thread per processor.
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
os.environ["JAX_ENABLE_X64"] = "1"
os.environ["JAX_PLATFORMS"] = "cpu"
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import diffrax  # pyright: ignore[reportMissingImports]
import jax  # pyright: ignore[reportMissingImports]
import jax.numpy as jnp  # pyright: ignore[reportMissingImports]

SIGMA, FRICTION, NOISE, H = 0.5, 0.1, 5.0, 0.01
STEPS = 500


def drift(t, y, args):
    x, _, v, omega = y
    force = -FRICTION * (v + omega)
    return jnp.stack([v, omega, force - jnp.cos(x), force / SIGMA])


def diffusion(t, y, args):
    return jnp.array([0.0, 0.0, NOISE, NOISE / SIGMA])


def by_diffrax(key):
    """Simulate one replica."""
    path = diffrax.UnsafeBrownianPath(shape=(), key=key)
    terms = diffrax.MultiTerm(diffrax.ODETerm(drift), diffrax.ControlTerm(diffusion, path))
    return diffrax.diffeqsolve(
        terms, diffrax.Euler(), t0=0.0, t1=STEPS * H, dt0=H, y0=jnp.zeros(4),
        saveat=diffrax.SaveAt(t1=True), adjoint=diffrax.ForwardMode(), max_steps=None,
    ).ys  # fmt: skip


def by_jax(keys):
    """Simulate one replica for each key, with the kernel's own scheme."""

    def step(state, key):
        x, theta, v, omega = state
        noise = NOISE * H**0.5 * jax.random.normal(key, x.shape)
        impulse = noise - H * FRICTION * (v + omega)
        v += impulse - H * jnp.cos(x)
        omega += impulse / SIGMA
        return (x + H * v, theta + H * omega, v, omega), None

    start = (jnp.zeros(len(keys)),) * 4
    return jax.lax.scan(step, start, jax.random.split(keys[0], STEPS))[0]


keys_of = cache(lambda replicas: jax.random.split(jax.random.key(0), replicas))
diffrax_run, jax_run = jax.jit(jax.vmap(by_diffrax)), jax.jit(by_jax)

SIZES = (1024, 4096, 16384)
PEERS = {
    "diffrax": (lambda n: jax.block_until_ready(diffrax_run(keys_of(n))), SIZES, STEPS),
    "JAX scan": (lambda n: jax.block_until_ready(jax_run(keys_of(n))), SIZES, STEPS),
}
"""See server.py."""
