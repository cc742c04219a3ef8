"""The potential energy of MuJoCo's soft limits of joints and tendons.

At rest, a limit that is exceeded by x pushes back with the force K I^2 x/((1 - I) A): the stiffness
K is given by `solref`, the impedance I(x) by `solimp`, and A is the limit's `invweight0`. See
"Solver parameters" in MuJoCo's documentation.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf.lookup import disabled

LEAST_IMPEDANCE, LARGEST_IMPEDANCE = 1e-4, 1 - 1e-4
"""mjMINIMP and mjMAXIMP."""

BALL = int(mujoco.mjtJoint.mjJNT_BALL)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)


class Limit(NamedTuple):
    """Limits of a coordinate from both sides."""

    coordinate: Callable[[mujoco.MjData], float]
    lower: float
    upper: float
    """The limits, with the margin inside."""
    stiffness: float
    """K/A."""
    impedance: Array
    """`solimp`, within MuJoCo's bounds."""

    def energy(self, data: mujoco.MjData) -> float:
        """Compute the energy of a state in J, the integral of the force over the excess."""
        value = self.coordinate(data)
        excess = max(self.lower - value, 0.0), max(value - self.upper, 0.0)
        return self.stiffness * sum(self._integral(x) for x in excess if x > 0)

    def _integral(self, excess: float) -> float:
        """Integrate I^2 x/(1 - I), which is smooth in three intervals."""
        width, middle = self.impedance[2:4]
        edges = np.minimum([0.0, middle * width, width, excess], excess)
        half = np.diff(edges)[:, np.newaxis] / 2
        x = edges[:-1, np.newaxis] + half * (NODES + 1)
        impedance = self._impedance(x)
        return float(np.sum(half * WEIGHTS * impedance**2 * x / (1 - impedance)))

    def _impedance(self, excess: Array) -> Array:
        first, last, width, middle, power = self.impedance
        if first == last or width <= mujoco.mjMINVAL:
            return np.full_like(excess, (first + last) / 2)
        x = np.minimum(excess / width, 1.0)
        rising = x**power / middle ** (power - 1)
        falling = 1 - (1 - x) ** power / (1 - middle) ** (power - 1)
        return first + (last - first) * np.where(x <= middle, rising, falling)


def limits(model: mujoco.MjModel) -> Iterator[Limit]:
    """Yield the limits of all joints and tendons."""
    if disabled(model, "limit"):
        return
    for joint in np.flatnonzero(model.jnt_limited):
        lower, upper = model.jnt_range[joint]
        yield _limit(
            model,
            _joint_value(model, int(joint)),
            (-np.inf, max(lower, upper)) if model.jnt_type[joint] == BALL else (lower, upper),
            model.jnt_margin[joint],
            model.dof_invweight0[model.jnt_dofadr[joint]],
            model.jnt_solref[joint],
            model.jnt_solimp[joint],
        )
    for tendon in np.flatnonzero(model.tendon_limited):
        yield _limit(
            model,
            _tendon_length(int(tendon)),
            model.tendon_range[tendon],
            model.tendon_margin[tendon],
            model.tendon_invweight0[tendon],
            model.tendon_solref_lim[tendon],
            model.tendon_solimp_lim[tendon],
        )


def _limit(
    model: mujoco.MjModel,
    coordinate: Callable[[mujoco.MjData], float],
    bounds: Any,
    margin: Any,
    invweight: Any,
    solref: Array,
    solimp: Array,
) -> Limit:
    impedance = solimp.copy()
    impedance[[0, 1, 3]] = np.clip(solimp[[0, 1, 3]], LEAST_IMPEDANCE, LARGEST_IMPEDANCE)
    impedance[2], impedance[4] = max(impedance[2], 0.0), max(impedance[4], 1.0)
    if solref[0] > 0:
        time = solref[0]
        if not disabled(model, "refsafe"):
            time = max(time, 2 * model.opt.timestep)
        stiffness = 1 / (impedance[1] * time * solref[1]) ** 2
    else:
        stiffness = -solref[0] / impedance[1] ** 2
    return Limit(
        coordinate, bounds[0] + margin, bounds[1] - margin, stiffness / invweight, impedance
    )


def _joint_value(model: mujoco.MjModel, joint: int) -> Callable[[mujoco.MjData], float]:
    start = int(model.jnt_qposadr[joint])
    if model.jnt_type[joint] != BALL:
        return lambda data: float(data.qpos[start])

    def angle(data: mujoco.MjData) -> float:
        quaternion = data.qpos[start : start + 4]
        return 2 * float(np.arctan2(np.linalg.norm(quaternion[1:]), abs(quaternion[0])))

    return angle


def _tendon_length(tendon: int) -> Callable[[mujoco.MjData], float]:
    return lambda data: float(data.ten_length[tendon])
