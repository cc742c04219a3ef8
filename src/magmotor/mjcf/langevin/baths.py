"""The heat baths of a model: which damper has which temperature."""

from collections.abc import Mapping
from numbers import Real

import mujoco
import numpy as np
from numpy.typing import ArrayLike
from scipy.constants import Boltzmann
from scipy.linalg import eigh

from magmotor.common.arrays import Array, Integers
from magmotor.common.checks import check_array, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.langevin.friction import Friction, friction_matrix, inertia_matrix
from magmotor.mjcf.langevin.tree import Dampers
from magmotor.mjcf.lookup import label, number_of

SYMMETRY, SMALL = 1e-9, 1e-14
"""Relative errors of a given matrix that are allowed, and that are attributed to rounding."""

KELVIN = 250.0, 400.0
"""Range of numbers that are more probable as temperatures in kelvin than as energies in joules."""

DEFECT_BY_FRICTION = 0.1
"""Allowed relative error of the kinetic energy in a piece of free motion, over g h."""

DEFECTS = 2.0**-20, 2.0**-12
"""Bounds of this error."""

LARGEST_MATRIX = 500
"""Number of velocities up to which the weakest friction is computed, in less than 0.1 s."""

KINDS = ("joint", "tendon", "actuator", "body")
"""Kinds of elements that can have a temperature of their own; the first that has a name wins."""


def doubt(kT: Mapping[str, float]) -> str:
    """Return a question about a temperature that may have been meant in kelvin, or nothing."""
    coldest, hottest = KELVIN
    for value in kT.values():
        if coldest <= value <= hottest:
            energy = f"{Boltzmann * value:.3g} J"
            return f"kT = {value:g} J is an energy: {value:g} K would be kT = {energy}"
    return ""


def read_kT(model: mujoco.MjModel, kT: float | Mapping[str, float]) -> dict[str, float]:
    """Return the temperature of each bath; a single one has the name `kT`.

    Raises
    ------
    ValueError
        A temperature is negative, or a name is not that of a joint, a tendon or a body.
    """
    if not isinstance(kT, Mapping):
        return {"kT": check_number("kT", kT, at_least=0, unit="J")}
    if not kT:
        raise ArgumentError(
            "kT", dict(kT), "must name at least one joint, tendon, actuator or body"
        )
    for name in kT:
        if name == "work":
            raise ArgumentError(
                "kT", name, "must be another name: `step` returns the work of all forces by it"
            )
        if all(number_of(model, kind, str(name)) < 0 for kind in KINDS):
            raise ArgumentError("kT", name, "must be the name of a joint, tendon, actuator or body")
    return {
        str(name): check_number(f"kT[{name!r}]", value, at_least=0, unit="J")
        for name, value in kT.items()
    }


def read_friction(model: mujoco.MjModel, friction: float | ArrayLike) -> Friction:
    """Return the friction that a user gives: a rate, damping (nv,) or a matrix (nv, nv).

    Raises
    ------
    ValueError
        The friction is negative, has the wrong shape, or is not positive semidefinite. The message
        names the joint.
    """
    nothing = np.zeros(0, dtype=np.int64)
    none = Friction(
        np.zeros(model.nv), np.zeros(model.ntendon), np.zeros(model.nout), np.zeros((0, 2)),
        nothing, nothing, np.zeros((0, model.nv)),
    )  # fmt: skip
    if isinstance(friction, Real) or (isinstance(friction, np.ndarray) and not friction.ndim):
        return none._replace(rate=check_number("friction", friction, at_least=0, unit="1/s"))
    matrix = check_array("friction", friction, ..., model.nv).copy()
    if matrix.shape not in {(model.nv,), (model.nv, model.nv)}:
        sentence = f"its shape must be ({model.nv},) or ({model.nv}, {model.nv})"
        raise ArgumentError("friction of shape", matrix.shape, sentence)
    diagonal = matrix if matrix.ndim == 1 else np.diag(matrix)
    for dof in np.flatnonzero(diagonal < 0):
        name = label(model, "joint", model.dof_jntid[dof])
        raise ArgumentError(f"friction of {name}", diagonal[dof], "must be zero or greater")
    if matrix.ndim == 1:
        return none._replace(dofs=matrix)
    if abs(matrix - matrix.T).max(initial=0) > SYMMETRY * abs(matrix).max(initial=0):
        raise ArgumentError("friction", matrix.tolist(), "must be symmetric")
    symmetric = (matrix + matrix.T) / 2
    values, vectors = np.linalg.eigh(symmetric)
    if values.min(initial=0) < -SYMMETRY * values.max(initial=0):
        worst = model.dof_jntid[np.argmax(abs(vectors[:, 0]))]
        sentence = (
            f"must be positive semidefinite; its smallest eigenvalue belongs to a motion of"
            f" {label(model, 'joint', worst)}"
        )
        raise ArgumentError("friction", f"matrix with the eigenvalue {values[0]:g}", sentence)
    return none._replace(rows=_rows_of(symmetric))


def _rows_of(matrix: Array) -> Array:
    """Return rows a_k of a positive semidefinite matrix sum_k a_k a_k^T, by Cholesky with pivots.

    Unlike eigenvectors, they have the same bits on any processor.
    """
    rows, rest = [], matrix
    for _ in matrix:
        pivot = int(np.argmax(np.diag(rest)))
        if rest[pivot, pivot] <= SMALL * matrix.max(initial=0):
            break
        rows.append(rest[pivot] / np.sqrt(rest[pivot, pivot]))
        rest = rest - np.outer(rows[-1], rows[-1])
    return np.array(rows).reshape(-1, len(matrix))


def dampers_with_temperatures(
    model: mujoco.MjModel,
    friction: Friction,
    kT: float | dict[str, float],
    *,
    constraints: bool,
) -> Dampers:
    """Combine all dampers with their temperatures.

    Raises
    ------
    ValueError
        With several baths, a damper has none, or does not belong to one element.
    """
    baths = _Baths(model, [*kT] if isinstance(kT, dict) else None)
    kT = kT if isinstance(kT, dict) else {"kT": kT}
    tendons = np.flatnonzero(friction.tendons)
    outputs = np.flatnonzero(friction.actuators)
    if len(kT) > 1:
        for what, exists in (
            ("friction as given", bool(friction.rate) or len(friction.rows) > 0),
            (
                "the damping of limits, equalities and contacts (see disable)",
                constraints,
            ),
        ):
            if exists:
                sentence = f"must be one temperature, since {what} belongs to no single joint"
                raise ArgumentError("kT", kT, sentence)
    dofs = np.array(
        [
            baths.of("joint", model.dof_jntid[i]) if damping else 0
            for i, damping in enumerate(friction.dofs)
        ],
        dtype=np.int64,
    )
    tendon_baths = baths.of_all("tendon", tendons)
    owners = _owners(model, outputs)
    actuator_baths = np.array([baths.of(*owner) for owner in owners], dtype=np.int64)
    drag_baths = baths.of_all("body", friction.drag_bodies)
    baths.check_used()
    temperatures = np.array([*kT.values()])
    return Dampers(
        defect=_largest_defect(model, friction),
        thermal=temperatures.min() * np.bincount(model.dof_treeid).astype(float),
        damping=np.ascontiguousarray(friction.dofs),
        kT=temperatures[dofs],
        baths=dofs,
        tendons=tendons,
        tendon_starts=model.ten_J_rowadr[tendons].astype(np.int64),
        tendon_counts=model.ten_J_rownnz[tendons].astype(np.int64),
        tendon_columns=model.ten_J_colind.astype(np.int64),
        tendon_damping=friction.tendons[tendons],
        tendon_kT=temperatures[tendon_baths],
        tendon_baths=tendon_baths,
        actuators=outputs,
        actuator_damping=friction.actuators[outputs],
        actuator_kT=temperatures[actuator_baths],
        actuator_baths=actuator_baths,
        rows=np.ascontiguousarray(friction.rows),
        drag=np.ascontiguousarray(friction.drag),
        drag_bodies=friction.drag_bodies.astype(np.int64),
        drag_geoms=friction.drag_geoms.astype(np.int64),
        drag_kT=temperatures[drag_baths],
        drag_baths=drag_baths,
        rate=friction.rate,
        constraint_kT=temperatures[0],
        has_rows=len(tendons) + len(outputs) > 0,
    )


def _owners(model: mujoco.MjModel, outputs: Integers) -> list[tuple[str, int]]:
    """Return the joint or tendon on which each output of an actuator acts; else the actuator."""
    found = []
    for output in outputs:
        i = int(np.searchsorted(model.actuator_outadr, output, side="right")) - 1
        kind = mujoco.mjtTrn(model.actuator_trntype[i]).name.removeprefix("mjTRN_").lower()
        kind = "joint" if kind.startswith("joint") else kind
        acts = kind in ("joint", "tendon")
        found.append((kind, int(model.actuator_trnid[i, 0])) if acts else ("actuator", i))
    return found


def _largest_defect(model: mujoco.MjModel, friction: Friction) -> float:
    """Return which error of the free motion the friction can make up for.

    The weakest friction at `qpos0` removes the part g h of an energy in a step. The result is a
    power of two, which does not depend on how a processor rounds.
    """
    weakest = friction.rate
    if model.nv <= LARGEST_MATRIX:
        data = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, data)
        matrix = friction_matrix(model, data, friction)
        try:
            weakest = eigh(matrix, inertia_matrix(model, data), eigvals_only=True)[0]
        except np.linalg.LinAlgError:  # joints that move nearly the same
            weakest = 0.0
    defect = np.clip(DEFECT_BY_FRICTION * weakest * model.opt.timestep, *DEFECTS)
    return float(2.0 ** np.round(np.log2(defect)))


class _Baths:
    """The number of the bath of each element."""

    def __init__(self, model: mujoco.MjModel, names: list[str] | None):
        self._model, self._names = model, names
        self._used: set[int] = set()

    def of_all(self, kind: str, numbers: Integers) -> Integers:
        return np.array([self.of(kind, number) for number in numbers], dtype=np.int64)

    def of(self, kind: str, number: int) -> int:
        """Return the bath of an element: by its name, or, for a joint, that of its body."""
        if self._names is None:
            return 0
        found = [(kind, int(number))]
        if kind == "joint":
            found.append(("body", int(self._model.jnt_bodyid[number])))
        for one, i in found:
            for bath, name in enumerate(self._names):
                if number_of(self._model, one, name) == i:
                    self._used.add(bath)
                    return bath
        places = "its name or that of its body" if kind == "joint" else "its name"
        sentence = f"must have the temperature of {label(self._model, kind, number)}, by {places}"
        raise ArgumentError("kT", self._names, sentence)

    def check_used(self) -> None:
        """Check that every bath has a damper."""
        for bath, name in enumerate(self._names or []):
            if bath not in self._used:
                raise ArgumentError("kT", name, "must be the name of something that damps")
