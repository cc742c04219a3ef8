"""Quantities whose errors are measured, as functions of the state."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from magmotor.advice.paths import RECORD, OutOfTime
from magmotor.common.arrays import Array
from magmotor.common.checks import check_choice, reject
from magmotor.mjcf.field_and_energy import magnetic_energy
from magmotor.mjcf.lookup import given_name

Function = Callable[[mujoco.MjModel, mujoco.MjData], object]

POSITIONS, ENERGY = "positions", "energy"

REST = 1e-6
"""Smaller motion is rest: of angles in rad, and of distances over the mean size of the bodies."""

ROUNDING = 1e-12
"""Smaller changes of a quantity, over its largest value, are rounding."""

_VALUES: dict[str, Callable[[mujoco.MjData, str], object]] = {
    "body": lambda data, name: data.body(name).xipos,
    "site": lambda data, name: data.site(name).xpos,
    "joint": lambda data, name: data.joint(name).qpos,
    "tendon": lambda data, name: data.tendon(name).length,
    "sensor": lambda data, name: data.sensor(name).data,
}
"""Quantities of one element, which a quantity names by its kind and name."""


@dataclass(frozen=True)
class Quantity:
    """A quantity of a model, with any number of components."""

    name: str
    of: Function
    scale: float = 0.0
    """Errors are relative to this, or to the range of the quantity if that is larger."""
    compute: Callable[[mujoco.MjModel, mujoco.MjData], object] = mujoco.mj_forward
    """Computes what the quantity needs."""
    least: float = 0.0
    """Smaller ranges are those of rest."""

    def along(
        self, model: mujoco.MjModel, data: mujoco.MjData, states: Array, until: float = np.inf
    ) -> Array:
        """Return the components (records, n) along a path; `data` serves as a workspace.

        Raises
        ------
        OutOfTime
            The clock `time.perf_counter` has passed `until`.
        ValueError
            A function fails, or does not always return the same number of values.
        """
        rows = []
        for state in states:
            if until < np.inf and time.perf_counter() > until:
                raise OutOfTime
            mujoco.mj_setState(model, data, state, RECORD)
            self.compute(model, data)
            rows.append(np.array(self.of(model, data), float).ravel())
            if len(rows[-1]) != len(rows[0]):
                raise reject(
                    f"quantity {self.name}", rows[-1], "must always be the same number of values"
                )
        return np.array(rows)

    def range(self, values: Array) -> float:
        """Return the diagonal of the box around values (records, n), and at least the scale."""
        return max(self.scale, float(np.linalg.norm(np.ptp(values, axis=0))))

    def changes(self, values: Array) -> bool:
        """Whether values (records, n) change by more than those of rest, and than rounding."""
        return self.range(values) > max(self.least, ROUNDING * np.abs(values).max())

    def scaled_by(self, model: mujoco.MjModel, data: mujoco.MjData, states: Array) -> "Quantity":
        """Return the quantity with the scale that its name has, found along a path."""
        if self.name != ENERGY:
            return self
        return replace(self, scale=float(KINETIC.along(model, data, states).max()))


def read_quantity(model: mujoco.MjModel, data: mujoco.MjData, quantity: str | Function) -> Quantity:
    """Return the quantity that a user names.

    Raises
    ------
    ValueError
        There is no such quantity, or a function does not return finite numbers.
    """
    size = REST * model.stat.meansize
    if callable(quantity):
        found = Quantity(
            name := getattr(quantity, "__name__", "function"), _guarded(name, quantity)
        )
    elif quantity == POSITIONS:
        found = Quantity(quantity, _positions(model), compute=mujoco.mj_kinematics, least=size)
    elif quantity == ENERGY:
        found = Quantity(quantity, _energy)
    else:
        kind, _, name = quantity.partition(" ")
        if kind not in _VALUES or not name:
            kinds = ", ".join(f"'{kind} NAME'" for kind in _VALUES)
            sentence = f"must be '{POSITIONS}', '{ENERGY}', {kinds}, or a function"
            raise reject("quantity", quantity, f"{sentence} of a model and its data")
        names = _names(model, kind)
        if not names:
            raise reject("quantity", quantity, f"the model has no {kind} with a name")
        check_choice(f"{kind} of the quantity", name, names)
        value = _VALUES[kind]
        least = 0.0 if kind == "sensor" else size
        if kind == "joint":
            least = REST * float(_units(model)[model.joint(name).qposadr[0]])
        found = Quantity(quantity, lambda _, data: value(data, name), least=least)
    _check(found, model, data)
    return found


def motion(model: mujoco.MjModel, states: Array) -> float:
    """Return by how much recorded states change: below `REST`, the model is at rest.

    Angles, quaternions and activations count as they are, distances over the mean size of the
    bodies.
    """
    positions, _, activations = np.split(
        np.ptp(states[:, 1 : 1 + model.nq + model.nv + model.na], axis=0),
        [model.nq, model.nq + model.nv],
    )
    return float(np.concatenate([positions / _units(model), activations]).max(initial=0.0))


def _units(model: mujoco.MjModel) -> Array:
    """Return the unit of each position: the mean size of the bodies for distances, otherwise 1."""
    units = np.ones(model.nq)
    distances = {mujoco.mjtJoint.mjJNT_FREE: 3, mujoco.mjtJoint.mjJNT_SLIDE: 1}
    for joint, begin in zip(model.jnt_type.tolist(), model.jnt_qposadr.tolist(), strict=True):
        units[begin : begin + distances.get(joint, 0)] = model.stat.meansize
    return units


def _guarded(name: str, function: Function) -> Function:
    """Return a user's function with NumPy's own warnings, whose mistakes name it."""

    def guarded(model: mujoco.MjModel, data: mujoco.MjData) -> object:
        try:
            with np.errstate(all="ignore"):
                return function(model, data)
        except ArithmeticError as error:
            raise reject("quantity", name, f"fails: {error}") from error

    return guarded


def _names(model: mujoco.MjModel, kind: str) -> tuple[str, ...]:
    counts = {"body": "nbody", "joint": "njnt"}
    count = getattr(model, counts.get(kind, f"n{kind}"))
    return tuple(name for i in range(count) if (name := given_name(model, kind, i)))


def _check(quantity: Quantity, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Check that a quantity is numbers, at least one, and finite."""
    mujoco.mj_forward(model, data)
    value = quantity.of(model, data)
    try:
        numbers = np.array(value, float).ravel()
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if not numbers.size or not np.isfinite(numbers).all():
        raise reject(f"quantity {quantity.name}", value, "must be finite numbers, at least one")


def _positions(model: mujoco.MjModel) -> Function:
    """Return the positions of all matter, whose distances are root mean squares over the mass.

    A body counts as its mass at the center and its second moments along the principal axes.
    """
    mass = model.body_mass
    total = mass[1:].sum() or 1.0
    inertia = model.body_inertia
    second = np.maximum(inertia.sum(axis=1, keepdims=True) / 2 - inertia, 0.0)
    own = 1 + np.flatnonzero(mass[1:] > 0)
    center = np.sqrt(mass[own] / total)[:, np.newaxis]
    axes = np.sqrt(second[own] / total)[:, np.newaxis, :]

    def positions(_: mujoco.MjModel, data: mujoco.MjData) -> Array:
        frames = data.ximat[own].reshape(-1, 3, 3) * axes
        return np.concatenate([(center * data.xipos[own]).ravel(), frames.ravel()])

    return positions


def _kinetic(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    mujoco.mj_energyVel(model, data)
    return float(data.energy[1])


def _energy(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    mujoco.mj_energyPos(model, data)
    magnetic = magnetic_energy(model, data) if model.nuser_site else 0.0
    return float(data.energy[0]) + _kinetic(model, data) + magnetic


KINETIC = Quantity("kinetic energy", _kinetic)
