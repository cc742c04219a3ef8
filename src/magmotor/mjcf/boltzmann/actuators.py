"""The potential energy of actuators without control: springs of their coordinates."""

from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.lookup import disabled, label

NONE, AFFINE = int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE)
TENDON, CRANK = int(mujoco.mjtTrn.mjTRN_TENDON), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK)
JOINTS = int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)
SCALARS = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)


class Spring(NamedTuple):
    """An actuator whose force at length l is offset + slope l, within its range."""

    number: int
    offset: float
    slope: float
    range: tuple[float, float]

    def energy(self, data: mujoco.MjData) -> float:
        """Compute the energy of a state in J."""
        length = float(data.actuator_length[self.number])
        force = self.offset + self.slope * length
        bounded = min(max(force, self.range[0]), self.range[1])
        if self.slope == 0:
            return -bounded * length
        return -bounded * (force - bounded / 2) / self.slope


def springs(model: mujoco.MjModel) -> Iterator[Spring]:
    """Yield the actuators that exert a force without control.

    Raises
    ------
    ValueError
        The force of one has no known potential. The message names the actuator.
    """
    if disabled(model, "actuation"):
        return
    for i in range(model.nu):
        group = model.actuator_group[i]
        off = 0 <= group < 31 and model.opt.disableactuator >> int(group) & 1
        offset, slope = model.actuator_biasprm[i, :2]
        bias = int(model.actuator_biastype[i])
        if off or bias == NONE or (bias == AFFINE and offset == slope == 0):
            continue
        if reason := _refused(model, i):
            sentence = f"{reason}; disable the flag actuation, or pass `potential`"
            raise ArgumentError("model", label(model, "actuator", i), sentence)
        bounds = (
            model.actuator_forcerange[i] if model.actuator_forcelimited[i] else (-np.inf, np.inf)
        )
        yield Spring(i, float(offset), float(slope), (float(bounds[0]), float(bounds[1])))


def _refused(model: mujoco.MjModel, actuator: int) -> str:
    """Return why the potential of an actuator is unknown; an empty string if it is known."""
    if model.actuator_biastype[actuator] != AFFINE:
        return "the bias of its force must be affine"
    transmission = int(model.actuator_trntype[actuator])
    target = int(model.actuator_trnid[actuator, 0])
    if transmission in JOINTS:
        if model.jnt_type[target] not in SCALARS:
            return "its joint must be a slide or a hinge"
        if model.jnt_actfrclimited[target]:
            return "the force of its joint must not be limited"
    elif transmission == TENDON:
        if model.tendon_actfrclimited[target]:
            return "the force of its tendon must not be limited"
    elif transmission != CRANK:
        return "it must act on a joint or a tendon"
    lower, upper = model.actuator_ctrlrange[actuator]
    if model.actuator_ctrllimited[actuator] and not lower <= 0 <= upper:
        return "the range of its control must contain zero"
    return ""
