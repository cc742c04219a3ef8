"""Quantities whose errors are measured, as functions of the state."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

from magmotor.advice.paths import RECORD, OutOfTime
from magmotor.common.arrays import Array, Integers
from magmotor.common.checks import check_choice
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.field_and_energy import magnetic_energy
from magmotor.mjcf.lookup import given_name, label, number_of

Function = Callable[[mujoco.MjModel, mujoco.MjData], object]

POSITIONS, ENERGY = "positions", "energy"

REST = 1e-6
"""Smaller motion is rest: of angles in rad, and of distances over the mean size of the bodies."""

ROUNDING = 1e-12
"""Smaller changes of a quantity, over its largest value, are rounding."""

ONE_WAY = 0.95
"""Part of a range by which something ends away from its start if it never came back."""

STILL = 1e-3
"""Elements that move by less than this part of what moves most are at rest beside it."""

_VALUES: dict[str, Callable[[mujoco.MjData, int], object]] = {
    "body": lambda data, number: data.body(number).xipos,
    "site": lambda data, number: data.site(number).xpos,
    "joint": lambda data, number: data.joint(number).qpos,
    "tendon": lambda data, number: data.tendon(number).length,
    "sensor": lambda data, number: data.sensor(number).data,
}
"""Quantities of one element, which a quantity names by its kind and name."""


_AXES = "x", "y", "z"


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
    size: int | None = None
    """Number of components of the whole; further ones belong to elements only."""
    elements: tuple[str, ...] = ()
    """Elements with ranges of their own, if there are several."""
    starts: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """The first component of each element."""
    units: Array = field(default_factory=lambda: np.zeros(0))
    """What the motion of each element is measured in, to compare it with that of others."""

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
                raise ArgumentError(
                    f"quantity {self.name}", rows[-1], "must always be the same number of values"
                )
        return np.array(rows)

    def distances(self, apart: Array) -> Array:
        """Return the size of differences (records, n): of the whole, and of each element.

        The result has the shape (records, 1 + elements).
        """
        whole = np.linalg.norm(apart[:, : self.size], axis=1)[:, np.newaxis]
        if not self.elements:
            return whole
        return np.hstack([whole, np.sqrt(np.add.reduceat(apart**2, self.starts, axis=1))])

    def ranges(self, values: Array) -> Array:
        """Return the range of the whole and of each element along a path (records, n).

        It is the diagonal of the box around the values. That of the whole is at least the scale;
        that of elements which are at rest beside others is infinite.
        """
        ranges = self.distances(np.ptp(values, axis=0)[np.newaxis])[0]
        moved = ranges[1:] / self.units
        ranges[1:][moved <= STILL * moved.max(initial=0.0)] = np.inf
        ranges[0] = max(self.scale, ranges[0])
        return ranges

    def changes(self, values: Array) -> bool:
        """Whether values (records, n) change by more than those of rest, and than rounding."""
        rounding = ROUNDING * np.abs(values[:, : self.size]).max()
        return self.ranges(values)[0] > max(self.least, rounding)

    def unturned(self, values: Array) -> list[str]:
        """Return the elements, or the whole, that never come back along a path (records, n)."""
        ranges = self.ranges(values)
        passed = self.distances(values[-1:] - values[:1])[0]
        names = np.array(self.elements or (self.name,))
        return names[(passed > ONE_WAY * ranges)[-len(names) :]].tolist()

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
        found = _positions(model, size)
    elif quantity == ENERGY:
        found = Quantity(quantity, _energy)
    else:
        kind, _, name = quantity.partition(" ")
        if kind not in _VALUES or not name:
            kinds = ", ".join(f"'{kind} NAME'" for kind in _VALUES)
            sentence = f"must be '{POSITIONS}', '{ENERGY}', {kinds}, or a function"
            raise ArgumentError("quantity", quantity, f"{sentence} of a model and its data")
        names = _names(model, kind)
        if not names:
            raise ArgumentError("quantity", quantity, f"the model has no {kind} with a name")
        check_choice(f"{kind} of the quantity", name, names)
        value, number = _VALUES[kind], number_of(model, kind, name)
        least = 0.0 if kind == "sensor" else size
        if kind == "joint":
            least = REST * float(_units(model)[model.jnt_qposadr[number]])
        found = Quantity(quantity, lambda _, data: value(data, number), least=least)
    count = _check(found, model, data)
    if found.size is not None or count == 1:
        return found
    names = _AXES if found.name.startswith(("body ", "site ")) else range(count)
    return replace(
        found,
        elements=tuple(f"component {name}" for name in names),
        starts=np.arange(count),
        units=np.ones(count),
    )


def relative(distances: Array, ranges: Array | float) -> float:
    """Return the largest of distances (records, k) over ranges, of which there may be fewer."""
    ranges = np.atleast_1d(ranges)
    return float(over(distances[:, : len(ranges)], ranges).max())


def over(distances: Array, ranges: Array) -> Array:
    """Return distances over ranges; it is 0 over an infinite range, and for no distance."""
    with np.errstate(all="ignore"):
        return np.where(np.isinf(ranges) | (distances == 0.0), 0.0, distances / ranges)


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
            raise ArgumentError("quantity", name, f"fails: {error}") from error

    return guarded


def _names(model: mujoco.MjModel, kind: str) -> tuple[str, ...]:
    counts = {"body": "nbody", "joint": "njnt"}
    count = getattr(model, counts.get(kind, f"n{kind}"))
    return tuple(name for i in range(count) if (name := given_name(model, kind, i)))


def _check(quantity: Quantity, model: mujoco.MjModel, data: mujoco.MjData) -> int:
    """Return how many numbers a quantity is: at least one, and all of them finite."""
    mujoco.mj_forward(model, data)
    value = quantity.of(model, data)
    try:
        numbers = np.array(value, float).ravel()
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if not numbers.size or not np.isfinite(numbers).all():
        raise ArgumentError(
            f"quantity {quantity.name}", value, "must be finite numbers, at least one"
        )
    return numbers.size


def _positions(model: mujoco.MjModel, least: float) -> Quantity:
    """Return the positions of all matter, whose distances are root mean squares over the mass.

    A body counts as its mass at the center and its second moments along the principal axes. The
    elements are the positions of all joints: angles, coordinates, and axes of what turns freely.
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
        whole = (center * data.xipos[own]).ravel(), frames.ravel()
        return np.concatenate([*whole, data.qpos[plain], _axes(data.qpos, turns)])

    names, plain, turns = [], [], []
    units = _units(model)
    kinds = mujoco.mjtJoint
    for joint, kind in enumerate(model.jnt_type.tolist()):
        name, first = label(model, "joint", joint), int(model.jnt_qposadr[joint])
        free = kind == kinds.mjJNT_FREE
        if free or kind == kinds.mjJNT_BALL:
            turns.append(first + 3 * free)
        if kind != kinds.mjJNT_BALL:
            plain += range(first, first + (3 if free else 1))
            names += [f"{axis} of {name}" for axis in _AXES] if free else [name]
    for first in turns:
        name = label(model, "joint", int(np.searchsorted(model.jnt_qposadr, first, "right")) - 1)
        names += [f"{axis} axis of {name}" for axis in _AXES]
    size, count = 12 * len(own), len(plain)
    return Quantity(
        POSITIONS, positions, compute=mujoco.mj_kinematics, least=least, size=size,
        elements=tuple(names) if len(names) > 1 else (),
        starts=size + np.concatenate([np.arange(count), count + 3 * np.arange(3 * len(turns))]),
        units=np.concatenate([units[plain], np.ones(3 * len(turns))]),
    )  # fmt: skip


def _axes(qpos: Array, turns: Sequence[int]) -> Array:
    """Return the axes of the rotations whose quaternions begin at these places."""
    frames = np.empty((len(turns), 9))
    for frame, first in zip(frames, turns, strict=True):
        mujoco.mju_quat2Mat(frame, qpos[first : first + 4])
    return frames.reshape(-1, 3, 3).transpose(0, 2, 1).ravel()


def _kinetic(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    mujoco.mj_energyVel(model, data)
    return float(data.energy[1])


def _energy(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    mujoco.mj_energyPos(model, data)
    magnetic = magnetic_energy(model, data) if model.nuser_site else 0.0
    return float(data.energy[0]) + _kinetic(model, data) + magnetic


KINETIC = Quantity("kinetic energy", _kinetic)
