"""How fast eddy currents brake, compared with the timestep, and up to which speed they are right.

MuJoCo applies their forces explicitly, so that in a step they must not take away more than all of a
velocity.
"""

import copy
from collections.abc import Iterator

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.failure import Failure, rounded_down
from magmotor.mjcf.declarations.marks import CONDUCTORS
from magmotor.mjcf.declarations.table import CONDUCTORS as PLATES
from magmotor.mjcf.lookup import label
from magmotor.mjcf.magnetism import magnetism
from magmotor.mjcf.unit_system import magnetic_constant


def strong_brakes(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield at most one failure in a state: a magnet below a plate, or too long a timestep."""
    plates = declared.conductors(model) if acting_forces(model) & CONDUCTORS else {}
    if not plates:
        return
    try:
        drag = _drag(model, state)
    except mujoco.FatalError as error:
        yield Failure(str(error), "(in the state given)")
        return
    if not drag.any():
        return
    response = np.empty_like(drag)
    mujoco.mj_solveM(model, state, response, np.ascontiguousarray(drag))
    rate = float(np.linalg.eigvals(response).real.max())
    if rate * model.opt.timestep > 1.0:
        step = rounded_down(1.0 / rate)
        yield Failure(
            _named(model, [*plates]),
            f"brakes a motion within {1.0 / rate:.2g} s, by eddy currents, so that the timestep"
            f" should be at most {step:g} s",
            timestep=step,
        )


def speed_notes(model: mujoco.MjModel) -> Iterator[Failure]:
    """Yield a note for each plate: far below which speed its forces are right."""
    plates = declared.conductors(model) if acting_forces(model) & CONDUCTORS else {}
    for geom, (conductivity, thickness) in plates.items():
        if conductivity == 0.0:
            continue
        speed = 2.0 / (magnetic_constant(model) * conductivity)
        bound = f"{speed:.2g} m^2/s over the height of a magnet"
        if thickness > 0.0:
            bound = f"{speed / thickness:.2g} m/s"
        yield Failure(
            label(model, "geom", geom),
            f"is a conductor: its forces are those at low speed, far below {bound}; at a tenth of"
            " this, the drag is 1 % too strong, and a lift of a tenth of the drag is missing",
            note=True,
        )


def _drag(model: mujoco.MjModel, state: mujoco.MjData) -> Array:
    """Return minus the generalized forces of eddy currents for each velocity of 1, (nv, nv)."""
    without = copy.copy(model)
    for row in declared.rows(model, PLATES):
        without.numeric_data[without.numeric_adr[row.numeric]] = 0.0
    drag = np.zeros((model.nv, model.nv))
    with magnetism():
        for sign, each in ((-1.0, model), (1.0, without)):
            data = mujoco.MjData(each)
            for dof in range(model.nv):
                data.qpos[:], data.ctrl[:], data.act[:] = state.qpos, state.ctrl, state.act
                data.mocap_pos[:], data.mocap_quat[:] = state.mocap_pos, state.mocap_quat
                data.qvel[:] = 0.0
                data.qvel[dof] = 1.0
                mujoco.mj_forward(each, data)
                drag[dof] += sign * data.qfrc_smooth
    return drag if np.isfinite(drag).all() else np.zeros_like(drag)


def _named(model: mujoco.MjModel, plates: list[int]) -> str:
    """Return the name of a plate, and how many others there are."""
    more = f" (and {len(plates) - 1} more like it)" if len(plates) > 1 else ""
    return label(model, "geom", plates[0]) + more
