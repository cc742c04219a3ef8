"""All forces that act on bodies but the Brownian ones, written into MuJoCo's own memory.

The callback applies them, and an integrator with a step of its own may.
"""

from numba import njit

from magmotor.engines.mujoco import memory
from magmotor.engines.mujoco.brownian import clear_driven_bodies
from magmotor.engines.mujoco.magnets import set_magnetic_wrenches
from magmotor.engines.mujoco.potential import add_potential_wrenches, clear_bodies_in_potentials


@njit(forceinline=True)
def apply_forces(model, data, offsets):
    """Overwrite the wrenches of bodies with what acts on them but noise; return how much acts.

    `model` and `data` are the addresses of mjModel and mjData, `offsets` their layout.
    """
    m = memory.words(model, memory.UNBOUNDED)
    d = memory.words(data, memory.UNBOUNDED)
    in_potentials = m[offsets.nuser_jnt // 8] > 0
    if m[offsets.nuser_body // 8] > 0:
        clear_driven_bodies(m, d, offsets)
    if in_potentials:
        clear_bodies_in_potentials(m, d, offsets)
    acting = set_magnetic_wrenches(m, d, offsets)
    if in_potentials:
        acting += add_potential_wrenches(m, d, offsets)
    return acting
