"""Free bodies with three unequal moments of inertia with jax-md's nvt_langevin."""

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


def no_energy(body, **_):
    return 0.0 * (jnp.sum(body.center) + jnp.sum(body.orientation.vec))
