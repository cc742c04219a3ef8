"""Linear stability of MuJoCo's integrators at rest, by theory and as found by a push."""

import math
import time
from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np

from magmotor.advice.paths import STATE, OutOfTime, Runs, quiet
from magmotor.common.arrays import Array
from magmotor.mjcf.declared import name_of

GROWTH = 1.002
"""Spectral radius of a step that counts as unstable; rounding and free drifts stay below."""

SHIFT = 1e-6
"""Differences of positions (m, rad) and velocities from rest."""

RESTLESS = 1e-6
"""Largest change of velocities within a timestep of the model that counts as rest."""

SETTLING = 20_000
"""Largest number of steps until a model is at rest."""

FACTOR = 1.4
"""Ratio of the timesteps among which the first unstable one is sought."""

PUSHED, PUSH, SMALL, GROWN = 2000, 1e-3, 1e-5, 1e3
"""Steps after a push, its speed with constraints and without, in m/s or rad/s, and growth of the
kinetic energy that counts as unstable. Drag of a fluid may end the growth at slow speeds."""

SHORTEST = 1 / 64
"""Shortest timestep that is tested, over the model's; what grows there grows by itself."""

LONGEST = 1000.0
"""Longest timestep that is tested, over the model's."""


class Limit(NamedTuple):
    """The largest stable timestep of an integrator at rest."""

    theory: float
    """In s, from the one-step map; infinite if all timesteps tested are stable, and NaN if
    constraints act at rest, which MuJoCo softens as the timestep grows."""
    found: float
    """In s, by runs after a push; infinite if none of them grows."""
    joints: tuple[tuple[str, float], ...]
    """The joints of the mode that grows first, and their parts of its kinetic energy."""


class Rest:
    """A state of rest, its number of constraints, and the map of one step near it."""

    def __init__(self, runs: Runs, start: Array, until: float):
        self.runs, self.start, self.until = runs, start, until
        model = runs.model
        self._n = model.nv
        self.size = 2 * model.nv + model.na
        runs.prepare("Euler", runs.timestep, start)
        mujoco.mj_fwdPosition(model, runs.data)
        self.constraints = int(runs.data.nefc)
        self._qpos = runs.data.qpos.copy()
        self._qvel = runs.data.qvel.copy()
        self._act = runs.data.act.copy()

    def deviation(self) -> Array:
        """Return how far the data are from rest: positions, velocities, activations."""
        model, data = self.runs.model, self.runs.data
        apart = np.empty(self._n)
        mujoco.mj_differentiatePos(model, apart, 1.0, self._qpos, data.qpos)
        return np.concatenate([apart, data.qvel - self._qvel, data.act - self._act])

    def displace(self, deviation: Array) -> None:
        """Move the data away from rest."""
        model, data, n = self.runs.model, self.runs.data, self._n
        mujoco.mj_integratePos(model, data.qpos, deviation[:n].copy(), 1.0)
        data.qvel += deviation[n : 2 * n]
        data.act += deviation[2 * n :]

    def step_map(self, integrator: str, timestep: float) -> Array:
        """Return the matrix of one step, by central differences; NaN if a step fails."""
        columns = np.empty((self.size, self.size))
        for i in range(self.size):
            if time.perf_counter() > self.until:
                raise OutOfTime
            ends = []
            for sign in (SHIFT, -SHIFT):
                self.runs.prepare(integrator, timestep, self.start)
                self.displace(sign * np.eye(self.size)[i])
                ends.append(
                    self.deviation() if self.runs.advance(1) else np.full(self.size, np.nan)
                )
            columns[:, i] = (ends[0] - ends[1]) / (2 * SHIFT)
        return columns

    def radius(self, integrator: str, timestep: float) -> float:
        """Return the spectral radius of one step; infinite if a step fails."""
        matrix = self.step_map(integrator, timestep)
        if not np.isfinite(matrix).all():
            return math.inf
        return float(np.abs(np.linalg.eigvals(matrix)).max())

    def mode(self, integrator: str, timestep: float) -> tuple[tuple[str, float], ...]:
        """Return the joints of the mode that grows fastest, by their parts of its kinetic energy.

        The inertia that couples joints is left out.
        """
        model, data, n = self.runs.model, self.runs.data, self._n
        matrix = self.step_map(integrator, timestep)
        if not np.isfinite(matrix).all():
            return ()
        values, vectors = np.linalg.eig(matrix)
        if np.abs(values).max() <= GROWTH:  # what grows is not linear
            return ()
        speed = vectors[n : 2 * n, np.abs(values).argmax()]
        self.runs.prepare(integrator, timestep, self.start)
        mujoco.mj_fwdPosition(model, data)
        inertia = np.empty((n, n))
        mujoco.mj_fullM(model, data, inertia)
        energy = np.diag(inertia) * np.abs(speed) ** 2
        parts: dict[str, float] = {}
        for dof, share in enumerate((energy / energy.sum()).tolist()):
            joint = int(model.dof_jntid[dof])
            name = name_of(model, "joint", joint)
            parts[name] = parts.get(name, 0.0) + share
        return tuple(sorted(parts.items(), key=lambda part: -part[1])[:3])


def find_rest(runs: Runs, until: float) -> Rest | None:
    """Let a model settle, and return its state of rest; None without one.

    Whenever its kinetic energy decreases, it is stopped, so that it descends in its potential.

    Raises
    ------
    OutOfTime
        The clock `time.perf_counter` has passed `until`.
    """
    model, data = runs.model, runs.data
    runs.prepare("implicitfast", runs.timestep)
    before, still = 0.0, 0
    with quiet():
        for _ in range(SETTLING):
            if time.perf_counter() > until:
                raise OutOfTime
            if not runs.advance(1):
                return None
            energy = runs.kinetic_energy()
            change = runs.timestep * np.abs(data.qacc).max(initial=0.0)
            still = still + 1 if change < RESTLESS else 0
            if energy <= before:
                data.qvel[:] = 0.0
                energy = 0.0
                if still > 20:
                    break
            before = energy
        else:
            return None
        data.qvel[:] = 0.0
        start = np.empty_like(runs.start)
        mujoco.mj_getState(model, data, start, STATE)
    return Rest(runs, start, until)


def stability_limit(rest: Rest, integrator: str) -> Limit | None:
    """Return the limits of an integrator at rest; None if what grows there grows by itself.

    Parameters
    ----------
    rest : Rest
    integrator : str
    """
    with quiet():
        shortest, longest = SHORTEST * rest.runs.timestep, LONGEST * rest.runs.timestep
        if rest.radius(integrator, shortest) > GROWTH or _grows(rest, integrator, shortest):
            return None
        timesteps = np.geomspace(
            shortest, longest, 1 + math.ceil(math.log(longest / shortest, FACTOR))
        )
        theory = math.nan
        if not rest.constraints:
            theory = _first(timesteps, lambda h: rest.radius(integrator, h) > GROWTH)
        near = timesteps[timesteps > 0.5 * min(rest.runs.timestep, theory)]
        if _grows(rest, integrator, near[0]):
            near = timesteps
        found = _first(near, lambda h: _grows(rest, integrator, h))
        first = found if math.isnan(theory) else theory
        joints = rest.mode(integrator, first) if math.isfinite(first) else ()
    return Limit(theory, found, joints)


def _first(timesteps: Array, fails: Callable[[float], bool]) -> float:
    """Return the first timestep that fails, to 1 %; infinite if none does."""
    low = timesteps[0]
    for high in timesteps[1:].tolist():
        if fails(high):
            while high / low > 1.01:
                middle = math.sqrt(low * high)
                low, high = (low, middle) if fails(middle) else (middle, high)
            return high
        low = high
    return math.inf


def _grows(rest: Rest, integrator: str, timestep: float) -> bool:
    """Whether the kinetic energy after a small push grows."""
    runs, n = rest.runs, rest.runs.model.nv
    runs.prepare(integrator, timestep, rest.start)
    push = np.zeros(rest.size)
    speed = PUSH if rest.constraints else SMALL
    push[n : 2 * n] = speed * np.random.default_rng(0).standard_normal(n)
    rest.displace(push)
    mujoco.mj_fwdPosition(runs.model, runs.data)
    first = runs.kinetic_energy()
    for _ in range(PUSHED // 50):
        if time.perf_counter() > rest.until:
            raise OutOfTime
        if not runs.advance(50):
            return True
        energy = runs.kinetic_energy()
        if energy > GROWN * first:
            return True
        if energy < 1e-12 * first:
            return False
    return False
