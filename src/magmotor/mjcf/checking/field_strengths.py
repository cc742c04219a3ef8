"""Applied fields alone, at dipoles and over pieces of iron; driven ones at their largest drive.

They are scaled so that mu0 is that of SI, whatever the units of the model are.
"""

from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.strengths import drive_limit, largest_drive
from magmotor.mjcf.declarations import table as of_table
from magmotor.mjcf.declarations.custom import BODY
from magmotor.mjcf.declarations.fields import GRADIENT, HEADER
from magmotor.mjcf.declarations.marks import FIELDS
from magmotor.mjcf.declared import rows
from magmotor.mjcf.unit_system import moment_scale
from magmotor.numerics.cubic_convolution import interpolate

STEP = 0.01
"""Step of finite differences over the half length of a piece."""

FAINT = 0.05
"""Changes of B^2 that are smaller, over its largest value, do not matter."""


class AppliedField(NamedTuple):
    """A field, and the frame to which it is fixed."""

    numbers: Array
    weld: int
    """The rigid body to which it is fixed."""
    origin: Array
    frame: Array
    """Its axes are the columns."""
    drive: float
    """The largest factor that its actuator allows, 1 without one or without a limit; scaled."""
    unbounded: int
    """The actuator that drives it, if nothing bounds that, or -1."""

    def at(self, points: Array) -> Array:
        """Return the flux densities (n, 3) in T at points (n, 3) in m; NaN outside a table."""
        numbers, local = self.numbers, (points - self.origin) @ self.frame
        found = np.tile(numbers[:3], (len(points), 1))
        if len(numbers) == GRADIENT:
            xx, xy, xz, yy, yz = numbers[3:].tolist()
            found += local @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, -xx - yy]])
        elif len(numbers) > GRADIENT:
            counts, nodes = tuple(int(n) for n in numbers[:3]), numbers[HEADER:]
            places = (local - numbers[3:6]) / numbers[6:9]
            found = np.array([interpolate(tuple(place), counts, nodes)[:3] for place in places])
        return self.drive * found @ self.frame.T

    @property
    def spacing(self) -> float:
        """Return the least distance of nodes in m; 1 where differences are exact at any step."""
        return float(self.numbers[6:9].min()) if len(self.numbers) > GRADIENT else 1.0


def applied_field(
    model: mujoco.MjModel, data: mujoco.MjData, points: Array, welds: NDArray
) -> Array:
    """Return the flux densities (n, 3) in T of applied fields at points (n, 3) in m.

    The points belong to rigid bodies (n,), on which fields that are fixed to them do not act. They
    are NaN outside of a table that acts.
    """
    total = np.zeros_like(points)
    moves = model.body_dofnum > 0
    for each in _fields(model, data) if acting_forces(model) & FIELDS else ():
        felt = (welds != each.weld) & (moves[welds] | moves[each.weld])
        if felt.any():
            total[felt] += each.at(points[felt])
    return total


def variation(
    model: mujoco.MjModel, data: mujoco.MjData, points: Array, welds: NDArray
) -> tuple[Array, Array]:
    """Return bounds of the first and second derivatives of applied fields at points (n, 3).

    They are those of m.B in all directions, for a unit moment m, in T/m and T/m^2, by differences;
    zero where a table ends within a spacing. The arguments are as in `applied_field`.
    """
    first, second = np.zeros((2, len(points)))
    moves = model.body_dofnum > 0
    for each in _fields(model, data) if acting_forces(model) & FIELDS else ():
        felt = (welds != each.weld) & (moves[welds] | moves[each.weld])
        if len(each.numbers) < GRADIENT or not felt.any():
            continue
        step = each.spacing / 2
        ways = step * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
        around = points[felt][:, np.newaxis, np.newaxis] + ways[:, np.newaxis] + ways
        flux = each.at(around.reshape(-1, 3)).reshape(-1, 7, 7, 3)
        along = (flux[:, 1:4, 0] - flux[:, 4:, 0]) / (2 * step)
        twice = (flux[:, 1:4, 1:4] - flux[:, 1:4, 4:] - flux[:, 4:, 1:4] + flux[:, 4:, 4:]) / (
            4 * step**2
        )
        for total, found in ((first, along), (second, twice.reshape(-1, 9, 3))):
            size = np.linalg.norm(np.nan_to_num(found), 2, axis=(1, 2))
            total[felt] += size
    return first, second


def unbounded_drives(model: mujoco.MjModel, data: mujoco.MjData, weld: int) -> set[int]:
    """Return the actuators without limits of the fields that act on a rigid body."""
    fields = _fields(model, data) if acting_forces(model) & FIELDS else ()
    return {each.unbounded for each in fields if each.weld != weld} - {-1}


def _fields(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[AppliedField]:
    """Yield the fields of a model."""
    scale = moment_scale(model)
    for row in rows(model, of_table.FIELDS):
        origin, frame, drive, unbounded = np.zeros(3), np.eye(3), 1.0, -1
        actuator = int(row.actuator)
        if actuator >= 0:
            saturation = float(model.tuple_objprm[row.element])
            drive = drive_limit(model, actuator, saturation)
            unbounded = actuator if largest_drive(model, actuator, saturation) == np.inf else -1
        if row.frame_type:
            named = row.frame_type == BODY
            origin = (data.xpos if named else data.site_xpos)[row.frame]
            frame = (data.xmat if named else data.site_xmat)[row.frame].reshape(3, 3)
        first = int(model.numeric_adr[row.numeric])
        numbers = model.numeric_data[first : first + int(model.numeric_size[row.numeric])]
        yield AppliedField(numbers, int(row.weld), origin, frame, drive / scale, unbounded)
