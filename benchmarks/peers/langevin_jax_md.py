"""Free bodies with three unequal moments of inertia with jax-md's nvt_langevin.

Version 0.2.29 draws the noise of the four components of a quaternion's momentum independently,
although they are correlated, so that rotations are too cold. On request it is drawn along the axes.
"""

import os

os.environ["JAX_ENABLE_X64"] = "1"  # read by JAX when it is imported
os.environ["JAX_PLATFORMS"] = "cpu"

import jax  # pyright: ignore[reportMissingImports]
import jax.numpy as jnp  # pyright: ignore[reportMissingImports]
import numpy as np
from jax_md import rigid_body, simulate, space  # pyright: ignore[reportMissingImports]
from langevin_estimates import of_bodies


def answer(
    what, mass, moments, damping, kT, timestep, every, records, replicas, lags, settle, seed
):
    """Estimate the motion.

    The friction of rotation is isotropic: the angular momentum along axis k decays at the rate
    gamma (1/I_1 + 1/I_2 + 1/I_3)^-1/I_k.
    """
    if what == "body, noise along the axes":
        simulate.stochastic_step.register(rigid_body.RigidBody)(along_the_axes)
    moments, key = np.array(moments), jax.random.key(seed)
    gamma = rigid_body.RigidBody(damping / mass, damping * np.sum(1 / moments))
    start, step = simulate.nvt_langevin(no_energy, space.free()[1], timestep, kT, gamma)
    attitude = jax.random.normal(key, (replicas, 4))
    attitude /= jnp.linalg.norm(attitude, axis=1, keepdims=True)
    place = rigid_body.RigidBody(jnp.zeros((replicas, 3)), rigid_body.Quaternion(attitude))
    inertia = rigid_body.RigidBody(jnp.array([mass]), jnp.tile(moments, (replicas, 1)))

    def advance(state, steps):
        return jax.lax.fori_loop(0, steps, lambda _, s: step(s), state)

    def record(state, _):
        state = advance(state, every)
        turn, momentum = state.position.orientation, state.momentum
        spin = rigid_body.conjugate_momentum_to_angular_momentum(turn, momentum.orientation)
        return state, (momentum.center / mass, spin / moments, turn.vec)

    def run(state):
        return jax.lax.scan(record, advance(state, settle), None, records)[1]

    found = jax.jit(run)(start(key, place, mass=inertia))
    v, omega, turns = (np.swapaxes(values, 0, 1) for values in found)
    return of_bodies(v, omega, turns, mass=mass, moments=moments, lags=lags)


def along_the_axes(state, dt, kT, gamma):
    """Replace jax-md's step of friction and noise, for `simulate.stochastic_step`."""
    key, center_key, turn_key = jax.random.split(state.rng, 3)
    rest, center, turn = rigid_body.split_center_and_orientation(state)
    center = simulate.stochastic_step(center.set(rng=center_key), dt, kT, gamma.center)
    normal = jax.random.normal(turn_key, (len(turn.mass), 3))
    decay = jnp.exp(-gamma.orientation * dt / turn.mass / jnp.sum(1 / turn.mass, 1)[:, None])
    noise = jnp.sqrt(4 * kT * turn.mass * (1 - decay**2)) * normal
    momentum = 0.0
    for k, permute in enumerate(rigid_body.MOMENTUM_PERMUTATION):
        axis = permute(turn.position.vec)
        along = decay[:, k] * jnp.sum(axis * turn.momentum.vec, axis=1) + noise[:, k]
        momentum += along[:, None] * axis
    turn = turn.set(momentum=rigid_body.Quaternion(momentum))
    return rigid_body.merge_center_and_orientation(rest.set(rng=key), center, turn)


def no_energy(body, **_):
    return 0.0 * (jnp.sum(body.center) + jnp.sum(body.orientation.vec))
