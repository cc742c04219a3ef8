"""Noise in equilibrium with the friction of a model, for those who step it by `mujoco.mj_step`.

Noise with the temperature kT belongs to friction C(q) if its generalized forces have the covariance
2 kT C(q). A Brownian wrench is a force of the world on a body, but the damper of a joint acts
between the body and its parent. So the rows of wrenches exist for drag in a fluid and for joints
that attach bodies to the world; `JointNoise` works for every tree.
"""

import warnings

import mujoco
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_integer, check_number, check_type
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.langevin.dry_friction import dry_contacts, dry_joints
from magmotor.mjcf.langevin.friction import (
    Friction,
    damper_rows,
    dampers,
    friction_matrix,
    model_friction,
)
from magmotor.mjcf.langevin.loop_calls import check_time
from magmotor.mjcf.langevin.supported import check_numbers
from magmotor.mjcf.langevin.temperature import MATCH, configurations, drive, joined
from magmotor.mjcf.lookup import label
from magmotor.noise import LARGEST_SEED, check_seed, normal

INSTEAD = "use mm.Langevin, which needs no rows, or the forces of mm.JointNoise in mj_step"


@checked
def brownian_rows(model: mujoco.MjModel, kT: float) -> Array:
    """Return the Brownian wrenches whose temperature is kT with the friction of a model.

    They exist for the drag of `option viscosity` on any tree, with six rows for each body, and for
    dampers of joints between a body and the world. Other dampers raise an error.

    Parameters
    ----------
    model : mujoco.MjModel
    kT : float
        Thermal energy in J.

    Returns
    -------
    ndarray, shape (nbody, 6 n)
        `user` numbers of each body: n rows of force (N sqrt(s)) and torque (N m sqrt(s)) in the
        world frame at its center of mass.

    Raises
    ------
    ValueError
        The friction of the model is not linear, or no such wrenches match a damper. The message
        names the damper and what to do.

    Notes
    -----
    The rows w satisfy J^T w w^T J = 2 kT C(q) up to 1e-6 in `qpos0` and in eight random
    configurations. Viscosity eta gives forces sqrt(2 kT 3 pi eta d) and torques
    sqrt(2 kT pi eta d^3), with MuJoCo's diameter d of the body. The temperature of a run also has
    the error of the integrator, see the tutorial.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> spec = mujoco.MjSpec.from_string('''
    ... <mujoco>
    ...   <option viscosity="0.1" integrator="RK4"/>
    ...   <custom><text name="magmotor" data="noise"/></custom>
    ...   <worldbody>
    ...     <body>
    ...       <joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.1" size=".01"/>
    ...       <body pos="0 0 -.1">
    ...         <joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.1" size=".01"/>
    ...       </body>
    ...     </body>
    ...   </worldbody>
    ... </mujoco>
    ... ''')
    >>> rows = mm.brownian_rows(spec.compile(), kT=1e-6)
    >>> for body, row in zip(spec.bodies, rows):
    ...     body.userdata = row
    >>> print(mm.describe(spec.compile()))  # doctest: +ELLIPSIS
    acting: noise, inside magmotor.magnetism()
    noise, Brownian wrenches: body 1 6, body 2 6
    temperature: kT = 1e-06 J
    not acting: noise outside of magmotor.magnetism(), since the model has no plugin ...
    """
    kT = check_number("kT", kT, at_least=0, unit="J")
    check_numbers(model)
    friction = model_friction(model)
    _check_dampers(model, friction)
    wrenches = np.sqrt(2 * kT) * _roots(model, friction)
    for data in configurations(model):
        wanted = kT * friction_matrix(model, data, friction)
        errors = abs(drive(model, data, wrenches) - wanted)
        if errors.max(initial=0) > MATCH * abs(wanted).max(initial=0):
            worst = int(errors.max(axis=0).argmax())
            name = label(model, "joint", model.dof_jntid[worst])
            raise _no_row(f"friction of {name}", wanted[worst, worst] / kT, "turns with the body")
    return wrenches


class JointNoise:
    """Noise for `mujoco.mj_step` on any tree, as generalized forces with the covariance 2 kT C(q).

    It matches the linear friction of the model: damping of joints, tendons and actuators, and
    `option viscosity`. A force is constant during a step, and the numbers depend on the seed, the
    replica and the step only, so that a repeated run is the same on any thread.

    Parameters
    ----------
    model : mujoco.MjModel
    kT : float
        Thermal energy in J.
    seed : int
        From 0 to 2^53 - 1.
    replica : int
        Number of the path, for several runs with one seed.

    Raises
    ------
    ValueError
        The friction of the model is not linear, nothing is damped, or another argument is invalid.
        The message names the element or the argument.

    Warns
    -----
    UserWarning
        Joints, tendons or contacts have dry friction, with which the temperature is too low.

    Notes
    -----
    The noise is exact; the temperature of a run also has the error of the integrator. MuJoCo's
    Euler, implicitfast and implicit heat trees, see the tutorial. Use RK4 with a short step, or
    `Langevin`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> model = mujoco.MjModel.from_xml_string('''
    ... <mujoco>
    ...   <option integrator="RK4"/>
    ...   <worldbody>
    ...     <body>
    ...       <joint axis="0 1 0" damping="1e-5"/>
    ...       <geom type="capsule" fromto="0 0 0 0 0 -.1" size=".01"/>
    ...     </body>
    ...   </worldbody>
    ... </mujoco>
    ... ''')
    >>> data = mujoco.MjData(model)
    >>> noise = mm.JointNoise(model, kT=1e-6, seed=1)
    >>> for _ in range(1000):
    ...     data.qfrc_applied[:] = noise.force(data)
    ...     mujoco.mj_step(model, data)
    """

    @checked
    def __init__(
        self, model: mujoco.MjModel, kT: float, *, seed: int = 0, replica: int = 0
    ) -> None:
        self._model = model
        self._kT = check_number("kT", kT, at_least=0, unit="J")
        self._path = (
            check_seed(seed),
            check_integer("replica", replica, at_least=0, at_most=LARGEST_SEED - 1),
        )
        check_numbers(model)
        self._friction = model_friction(model)
        self._scratch = mujoco.MjData(model)
        self._turns = any(c.any() for c in self._friction[1:4])
        if not (self._turns or self._friction.dofs.any()):
            raise ArgumentError(
                "friction of the model", 0, "must not be zero: nothing would reach kT"
            )
        if dry := dry_joints(model) + dry_contacts(model):
            more = f", and {len(dry) - 1} more" if len(dry) > 1 else ""
            warnings.warn(
                f"{dry[0]}{more}: dry friction has no noise, so that the temperature will be too"
                " low; disable the flag frictionloss, or contact, or set condim=1",
                stacklevel=4,
            )

    def force(self, data: mujoco.MjData) -> Array:
        """Return the generalized noise force of the step that begins with `data`, shape (nv,).

        Its place is `data.qfrc_applied`, where you may add forces of your own. `data` does not
        change.

        Parameters
        ----------
        data : mujoco.MjData

        Returns
        -------
        ndarray, shape (nv,)

        Raises
        ------
        ValueError
            The data belong to another model, or their time is invalid.
        """
        model, scratch = self._model, self._scratch
        check_type("data", data, mujoco.MjData)
        if data.model is not model:
            raise ArgumentError("data.model", data.model, "must be the model of this JointNoise")
        check_time(data, model.opt.timestep)
        if self._turns:
            scratch.qpos[:], scratch.mocap_pos[:] = data.qpos, data.mocap_pos
            scratch.mocap_quat[:] = data.mocap_quat
            mujoco.mj_fwdPosition(model, scratch)
        coefficients, rows = dampers(model, scratch, self._friction)
        step = round(data.time / model.opt.timestep)
        numbers = [normal(*self._path, step, channel, 1, 0) for channel in range(len(rows))]
        with np.errstate(all="ignore"):
            amplitudes = np.sqrt(2 * self._kT * coefficients / model.opt.timestep)
            force = rows.T @ (amplitudes * numbers)
        if not np.isfinite(force).all():
            sentence = "must be finite, and so must be the positions in data"
            raise ArgumentError("force", force.tolist(), sentence)
        return force


def _no_row(name: str, value: float, why: str) -> ValueError:
    """Return the error for a damper that no Brownian wrench matches."""
    return ArgumentError(
        name, value, f"no wrench of the world can match it, since it {why}: {INSTEAD}"
    )


def _check_dampers(model: mujoco.MjModel, friction: Friction) -> None:
    """Check that dampers of joints, tendons and actuators act between one body and the world."""
    seen = [damper_rows(model, data, friction) for data in configurations(model)]
    owners = {
        "joint": model.dof_jntid,
        "tendon": np.arange(model.ntendon),
        "actuator": np.repeat(np.arange(model.nactuator), model.actuator_outnum),
    }
    for kind, numbers in owners.items():
        coefficients = seen[0][kind][0]
        moved = np.any([parts[kind][1] for parts in seen], axis=0)
        for k in np.flatnonzero(coefficients):
            bodies = set(model.dof_bodyid[moved[k]].tolist())
            parents = {int(model.body_parentid[body]) for body in bodies}
            bodies |= {parent for parent in parents if model.body_treeid[parent] >= 0}
            if len(bodies) > 1:
                names = joined([label(model, "body", body) for body in sorted(bodies)])
                name = f"damping of {label(model, kind, numbers[k])}"
                raise _no_row(name, coefficients[k], f"acts between {names}, which move")


def _roots(model: mujoco.MjModel, friction: Friction) -> Array:
    """Return sqrt(c) times a wrench (nbody, 6 n) on the body for each damper.

    Joints that shift the body take a force, and those that turn it a torque.
    """
    data = next(configurations(model))
    wrenches: list[list[Array]] = [[] for _ in range(model.nbody)]
    parts = damper_rows(model, data, friction)
    for kind in ("joint", "tendon", "actuator"):
        for coefficient, row in zip(*parts[kind], strict=True):
            if coefficient and row.any():
                body = int(model.dof_bodyid[row != 0][0])
                wrenches[body].append(np.sqrt(coefficient) * _wrench(model, data, body, row))
    for body, geom, drag in zip(
        friction.drag_bodies, friction.drag_geoms, friction.drag, strict=True
    ):
        arm = (data.xipos[body] if geom < 0 else data.geom_xpos[geom]) - data.xipos[body]
        force = np.hstack([np.eye(3), np.cross(arm, np.eye(3))])
        torque = np.hstack([np.zeros((3, 3)), np.eye(3)])
        wrenches[body] += [*np.sqrt(drag[0]) * force, *np.sqrt(drag[1]) * torque]
    rows = np.zeros((model.nbody, max(map(len, wrenches)), 6))
    for body, own in enumerate(wrenches):
        rows[body, : len(own)] = np.reshape(own, (-1, 6))
    return rows.reshape(model.nbody, -1)


def _wrench(model: mujoco.MjModel, data: mujoco.MjData, body: int, row: Array) -> Array:
    """Return the wrench on a body that hangs on the world whose generalized force is `row`."""
    jacobian = np.empty((6, model.nv))
    mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], body)
    own = model.dof_bodyid == body
    turns = jacobian[3:].any(axis=0)
    return np.concatenate(
        [
            np.linalg.pinv(part[:, own & chosen]).T @ row[own & chosen]
            for part, chosen in ((jacobian[:3], ~turns), (jacobian[3:], turns))
        ]
    )
