"""The linear friction of a model: C(q), a sum of dampers c a^T a with forces -c (a qvel) a^T.

MuJoCo has four kinds: the damping of joints, of tendons and of actuators, and Stokes drag of bodies
in a viscous fluid. Only such friction obeys a law of fluctuation and dissipation in which the noise
follows from C(q) and the temperature.
"""

from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.lookup import disabled, label

Integers = NDArray[np.int64]

AFFINE = int(mujoco.mjtGain.mjGAIN_AFFINE)
"""Type of an affine gain; that of an affine bias is the same, and only constants are below it."""

ON_JOINTS = [int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)]
ON_TENDONS = [int(mujoco.mjtTrn.mjTRN_TENDON)]

NO_LAW = "has no law of fluctuation and dissipation"
WITHOUT_DAMPER = "make it zero or disable the flag damper"
WITHOUT_ACTUATION = "change it or disable the flag actuation"


class Friction(NamedTuple):
    """Coefficients of all dampers of a model, each at least zero."""

    dofs: Array
    """Damping of each degree of freedom in N s/m or N m s, shape (nv,).

    It includes the damping of actuators that act on its joint.
    """
    tendons: Array
    """Damping of each tendon, including that of actuators that act on it, shape (ntendon,)."""
    actuators: Array
    """c of the force -c dlength/dt of each output of an actuator, shape (nout,)."""
    drag: Array
    """Drag of force (N s/m) and of torque (N m s) against motion in the fluid, shape (n, 2)."""
    drag_bodies: Integers
    """Body on which each drag acts, shape (n,)."""
    drag_geoms: Integers
    """Geom at whose center it acts; -1 for the body's center of mass; shape (n,)."""
    rows: Array
    """Rows a of further dampers with c = 1, shape (k, nv), which only a user gives."""
    rate: float = 0.0
    """Rate in 1/s of the friction rate M, which only a user gives."""


def model_friction(model: mujoco.MjModel) -> Friction:
    """Return the friction of a model as its flags leave it.

    Raises
    ------
    ValueError
        A damper is negative, is not linear, or acts together with a limit, so that no noise of
        equilibrium belongs to it. The message names the element and what to do.
    """
    dofs, tendons = _damping(model)
    geoms, bodies, drag = _drag(model)
    rows = np.zeros((0, model.nv))
    return Friction(dofs, tendons, _actuators(model), drag, bodies, geoms, rows)


def inertia_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the inertia M(q), shape (nv, nv), for which `data` has been computed."""
    inertia = np.empty((model.nv, model.nv))
    for row, unit in zip(inertia, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    return inertia


def friction_matrix(model: mujoco.MjModel, data: mujoco.MjData, friction: Friction) -> Array:
    """Return C(q), shape (nv, nv), in the configuration for which `data` has been computed.

    `mujoco.mj_fwdPosition(model, data)` computes what is needed.
    """
    coefficients, rows = dampers(model, data, friction)
    matrix = (rows.T * coefficients) @ rows
    return matrix + friction.rate * inertia_matrix(model, data) if friction.rate else matrix


def dampers(model: mujoco.MjModel, data: mujoco.MjData, friction: Friction) -> tuple[Array, Array]:
    """Return the coefficients c (n,) and rows a (n, nv) of all dampers."""
    parts = damper_rows(model, data, friction).values()
    coefficients = np.concatenate([c for c, _ in parts])
    return coefficients, np.vstack([rows for _, rows in parts])


def damper_rows(
    model: mujoco.MjModel, data: mujoco.MjData, friction: Friction
) -> dict[str, tuple[Array, Array]]:
    """Return the coefficients and rows of each kind of damper."""
    return {
        "joint": (friction.dofs, np.eye(model.nv)),
        "tendon": (friction.tendons, _dense(model, data.ten_J, model, "ten_J")),
        "actuator": (friction.actuators, _dense(model, data.actuator_moment, data, "moment")),
        "drag": (np.repeat(friction.drag, 3), _drag_rows(model, data, friction)),
        "given": (np.ones(len(friction.rows)), friction.rows),
    }


def _dense(model: mujoco.MjModel, values: Array, owner: object, prefix: str) -> Array:
    """Return the dense form (n, nv) of a sparse matrix of MuJoCo."""
    counts, starts, columns = (
        getattr(owner, f"{prefix}_{name}") for name in ("rownnz", "rowadr", "colind")
    )
    matrix = np.zeros((len(counts), model.nv))
    if matrix.size:
        mujoco.mju_sparse2dense(matrix, values, counts, starts, columns)
    return matrix


def _drag_rows(model: mujoco.MjModel, data: mujoco.MjData, friction: Friction) -> Array:
    """Return the Jacobians (6 n, nv) of velocity and angular velocity where the drag acts."""
    jacobians = np.empty((len(friction.drag), 6, model.nv))
    for jacobian, body, geom in zip(
        jacobians, friction.drag_bodies, friction.drag_geoms, strict=True
    ):
        point = data.xipos[body] if geom < 0 else data.geom_xpos[geom]
        mujoco.mj_jac(model, data, jacobian[:3], jacobian[3:], point, body)
    return jacobians.reshape(6 * len(friction.drag), model.nv)


def _damping(model: mujoco.MjModel) -> tuple[Array, Array]:
    """Return the damping of all degrees of freedom and of all tendons."""
    if disabled(model, "damper"):
        return np.zeros(model.nv), np.zeros(model.ntendon)
    joints, tendons = np.zeros(model.njnt), model.tendon_damping.copy()
    for i in range(model.nactuator):
        for totals, kinds in ((joints, ON_JOINTS), (tendons, ON_TENDONS)):
            if model.actuator_trntype[i] in kinds:
                gear = model.actuator_gear[model.actuator_outadr[i], 0]
                totals[model.actuator_trnid[i, 0]] += gear**2 * model.actuator_damping[i]
    dofs = model.dof_damping + joints[model.dof_jntid]
    owners = (("joint", model.dof_dampingpoly, dofs), ("tendon", model.tendon_dampingpoly, tendons))
    for kind, polynomials, damping in (*owners, ("actuator", model.actuator_dampingpoly, [])):
        for i in np.flatnonzero(polynomials.any(axis=1)):
            owner = label(model, kind, model.dof_jntid[i] if kind == "joint" else i)
            sentence = f"damping that depends on velocity {NO_LAW}: {WITHOUT_DAMPER}"
            raise ArgumentError(f"{owner}: dampingpoly", polynomials[i].tolist(), sentence)
        for i in np.flatnonzero(np.asarray(damping) < 0):
            owner = label(model, kind, model.dof_jntid[i] if kind == "joint" else i)
            sentence = f"negative damping {NO_LAW}: {WITHOUT_DAMPER}"
            raise ArgumentError(f"{owner}: damping", damping[i], sentence)
    return dofs, tendons


def _actuators(model: mujoco.MjModel) -> Array:
    """Return c of the force -c dlength/dt of all outputs of actuators."""
    coefficients = np.zeros(model.nout)
    for i in acting_actuators(model):
        outputs = model.actuator_outadr[i] + np.arange(model.actuator_outnum[i])
        coefficients[outputs] = _velocity_gain(model, i)
        if coefficients[outputs].any():
            _check_unlimited(model, i, outputs)
    return coefficients


def acting_actuators(model: mujoco.MjModel) -> Iterator[int]:
    """Yield the actuators that neither the flag actuation nor their group disables."""
    if disabled(model, "actuation"):
        return
    for i, group in enumerate(model.actuator_group):
        if not (0 <= group <= 30 and model.opt.disableactuator >> group & 1):
            yield i


def _velocity_gain(model: mujoco.MjModel, i: int) -> float:
    """Return c of an actuator, the negative of its bias per velocity."""
    name = label(model, "actuator", i)
    types = {
        "gaintype": (mujoco.mjtGain, AFFINE),
        "biastype": (mujoco.mjtBias, AFFINE),
        "dyntype": (mujoco.mjtDyn, 0),
    }
    for field, (kinds, last) in types.items():
        kind = int(getattr(model, f"actuator_{field}")[i])
        if kind > last:
            known = "none" if field == "dyntype" else "affine, or simpler"
            why = "since its state changes by itself" if field == "dyntype" else "to be linear"
            sentence = f"must be {known}, {why}: {WITHOUT_ACTUATION}"
            word = kinds(kind).name.rpartition("_")[2].lower()
            raise ArgumentError(f"{name}: {field}", word, sentence)
    if model.actuator_plugin[i] >= 0:
        number = int(model.actuator_plugin[i])
        raise ArgumentError(f"{name}: plugin", number, f"must be none: {WITHOUT_ACTUATION}")
    if model.actuator_delay[i]:
        sentence = f"a delayed force {NO_LAW}: {WITHOUT_ACTUATION}"
        raise ArgumentError(f"{name}: delay", model.actuator_delay[i], sentence)
    if model.actuator_gaintype[i] == AFFINE and model.actuator_gainprm[i, 2]:
        sentence = f"damping that depends on the control {NO_LAW}: {WITHOUT_ACTUATION}"
        raise ArgumentError(f"{name}: gainprm[2]", model.actuator_gainprm[i, 2], sentence)
    if model.actuator_biastype[i] != AFFINE:
        return 0.0
    if model.actuator_biasprm[i, 2] > 0:
        sentence = f"must not be positive, since negative damping {NO_LAW}: {WITHOUT_ACTUATION}"
        raise ArgumentError(f"{name}: biasprm[2]", model.actuator_biasprm[i, 2], sentence)
    return -model.actuator_biasprm[i, 2]


def _check_unlimited(model: mujoco.MjModel, i: int, outputs: Integers) -> None:
    """Check that no limit clamps the force of an actuator that damps."""
    limits = [("actuator", "forcerange", i)] * bool(model.actuator_forcelimited[i])
    if model.actuator_trntype[i] in ON_TENDONS:
        tendon = model.actuator_trnid[i, 0]
        limits += [("tendon", "actfrcrange", tendon)] * bool(model.tendon_actfrclimited[tendon])
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    driven = _dense(model, data.actuator_moment, data, "moment")[outputs].any(axis=0)
    joints = np.unique(model.dof_jntid[driven])
    limits += [("joint", "actfrcrange", j) for j in joints if model.jnt_actfrclimited[j]]
    for kind, field, number in limits:
        value = getattr(model, f"{kind}_{field}" if kind != "joint" else f"jnt_{field}")[number]
        sentence = (
            f"must be without limits, since {label(model, 'actuator', i)} damps (its biasprm[2] is"
            f" not zero), and a damper that is clamped {NO_LAW}: {WITHOUT_ACTUATION}"
        )
        raise ArgumentError(f"{label(model, kind, number)}: {field}", value.tolist(), sentence)


def _drag(model: mujoco.MjModel) -> tuple[Integers, Integers, Array]:
    """Return the geoms (or -1), bodies and coefficients of all Stokes drags."""
    geoms, bodies, diameters, shares = [], [], [], []
    if _viscosity(model):
        for body in np.flatnonzero((model.body_treeid >= 0) & (model.body_mass >= mujoco.mjMINVAL)):
            own = model.body_geomadr[body] + np.arange(model.body_geomnum[body])
            dragged = own[model.geom_fluid[own, 0] > 0].tolist()
            geoms += dragged or [-1]
            bodies += [body] * (len(dragged) or 1)
            diameters += [_geom_diameter(model, g) for g in dragged] or [_box_side(model, body)]
            shares += model.geom_fluid[dragged, 0].tolist() or [1.0]
    d = np.array(diameters, dtype=float)
    scale = np.pi * model.opt.viscosity * np.array(shares, dtype=float)
    drag = np.column_stack([3 * scale * d, scale * d**3])
    return np.array(geoms, dtype=np.int64), np.array(bodies, dtype=np.int64), drag


def _viscosity(model: mujoco.MjModel) -> float:
    """Return the viscosity of the fluid, which must rest and have no density; 0 without forces."""
    if model.nv == 0 or (disabled(model, "spring") and disabled(model, "damper")):
        return 0.0
    if model.opt.density:
        sentence = f"must be set to zero, since drag by the square of the velocity {NO_LAW}"
        raise ArgumentError("option density", model.opt.density, sentence)
    if not 0 <= model.opt.viscosity < np.inf:
        raise ArgumentError(
            "option viscosity", model.opt.viscosity, "must be zero or greater, and finite"
        )
    if model.opt.viscosity and model.opt.wind.any():
        sentence = "must be zero in a viscous fluid, since wind drives the model"
        raise ArgumentError("option wind", model.opt.wind.tolist(), sentence)
    return model.opt.viscosity


def _box_side(model: mujoco.MjModel, body: np.int64) -> float:
    """Return the mean side of the box that has the body's mass and moments of inertia."""
    moments = model.body_inertia[body]
    squares = np.maximum(moments.sum() - 2 * moments, mujoco.mjMINVAL) / model.body_mass[body] * 6
    return float(np.sqrt(squares).mean())


def _geom_diameter(model: mujoco.MjModel, geom: int) -> float:
    """Return twice the mean semiaxis of a geom."""
    kind, (x, y, z) = model.geom_type[geom], model.geom_size[geom]
    semiaxes = {
        int(mujoco.mjtGeom.mjGEOM_SPHERE): (x, x, x),
        int(mujoco.mjtGeom.mjGEOM_CAPSULE): (x, x, x + y),
        int(mujoco.mjtGeom.mjGEOM_CYLINDER): (x, x, y),
    }
    return float(2 * np.mean(semiaxes.get(int(kind), (x, y, z))))
