"""Drives: by how much actuators scale the moments of coils, and applied fields.

The rules are those of `magmotor.mjcf.forces.drives`, with one exception: MuJoCo Warp does not
replace controls that are NaN by 0, and so the magnets of that world become NaN, too.
"""

from typing import Any

import mujoco
import numpy as np
import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def drive_in(drive: wp.array2d[float], world: int, row: int):
    """Return a drive; that of row -1 is 1."""
    u = float(1.0)
    if row >= 0:
        u = drive[world, row]
    return u


@wp.kernel
def _read_drives(
    actuator: wp.array[int],
    saturation: wp.array[float],
    acts: bool,
    clamps: bool,
    actuator_actnum: wp.array[int],
    actuator_actadr: wp.array[int],
    actuator_ctrlnum: wp.array[int],
    actuator_ctrladr: wp.array[int],
    ctrllimited: wp.array[bool],
    ctrlrange: wp.array2d[wp.vec2],
    act: wp.array2d[float],
    ctrl: wp.array2d[float],
    drive: wp.array2d[float],
):
    world, row = wp.tid()
    k = actuator[row]
    u = float(0.0)
    if acts and k >= 0:
        if actuator_actnum[k] > 0:
            u = act[world, actuator_actadr[k] + actuator_actnum[k] - 1]
        elif actuator_ctrlnum[k] > 0:
            i = actuator_ctrladr[k]
            u = ctrl[world, i]
            if clamps and ctrllimited[i]:
                limits = ctrlrange[world % ctrlrange.shape[0], i]
                # Comparisons leave NaN as it is.
                if u < limits[0]:
                    u = limits[0]
                elif u > limits[1]:
                    u = limits[1]
    if saturation[row] != 0.0:
        part = u / saturation[row]
        u = u / wp.sqrt(1.0 + part * part)
    drive[world, row] = u


class Drives:
    """The drives of coils, and after them those of fields.

    Parameters
    ----------
    model : mujoco.MjModel
    rows : list of records
        Those of coils and of fields with an actuator, from the table of the model.

    Attributes
    ----------
    count : int
    """

    def __init__(self, model: mujoco.MjModel, rows: list[Any]):
        self.count = len(rows)
        # MuJoCo Warp has no groups of disabled actuators. In C, their coils are off.
        off = [_is_disabled(model, row.actuator) for row in rows]
        actuator = [-1 if o else row.actuator for row, o in zip(rows, off, strict=True)]
        self._actuator = wp.array(np.array(actuator, np.int32), dtype=int)
        saturation = [model.tuple_objprm[row.element] for row in rows]
        self._saturation = wp.array(np.array(saturation, np.float32), dtype=float)

    def read(self, m: Any, d: Any, drive: Any) -> None:
        """Write the drives of this moment, shape (nworld, count)."""
        flags = int(m.opt.disableflags)
        acts = not flags & int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
        clamps = not flags & int(mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL)
        wp.launch(
            _read_drives,
            dim=(d.nworld, self.count),
            inputs=[
                self._actuator, self._saturation, acts, clamps, m.actuator_actnum,
                m.actuator_actadr, m.actuator_ctrlnum, m.actuator_ctrladr,
                m.actuator_ctrllimited, m.actuator_ctrlrange, d.act, d.ctrl,
            ],
            outputs=[drive],
        )  # fmt: skip


def _is_disabled(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator is in a disabled group."""
    group = int(model.actuator_group[actuator])
    return 0 <= group < 31 and bool(model.opt.disableactuator & (1 << group))
