"""Viscous slip f = -c V of a sphere on a plane, realized by a frictional contact.

If the elliptic cone of a contact is never reached and its friction rows are purely damped
(`solreffriction="0 -b"`), the friction force is f = -(b/d) V/(A + R) - a0/(A + R). V is the slip
velocity, a0 the slip acceleration without friction, A = 1/m + r^2/I the inverse inertia at the
contact, d the impedance and R the regularization. For R >> A, the second term is negligible, and
b = c d (A + R) gives f = -c V. A tiny `impratio` makes R huge, and so does the smallest impedance
in a contact that bears no load.
"""

import math
from copy import copy
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from magmotor.common.arguments import check_flag
from magmotor.common.arrays import Array
from magmotor.common.checks import check_number, check_type
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.mjcf import model_parts
from magmotor.mjcf.lookup import disabled, label, number_of

CONTACT_RATE = 20.0
"""Rate (1/s) at which a sphere settles on a plane that bears it, critically damped."""

STIFF, SOFT = 0.9999, 0.0001
"""MuJoCo's largest and smallest impedance d."""

STIFFNESS, NORMAL_DAMPING = CONTACT_RATE**2, 2 * CONTACT_RATE
"""Stiffness and damping of the contact's normal direction, per mass, in 1/s^2 and 1/s."""

ALWAYS_IN_CONE = 1e6
"""Friction coefficient of the viscous contact, so large that its cone is never reached."""

FILM = 1e-3
"""Margin (m) within which a contact that bears no load is active, with its point at -r e_z."""

WEAK = 1e-4
"""Fraction of the normal direction's stiffness and damping in a contact that bears no load.

The contact pushes the sphere up by this fraction of STIFFNESS FILM = 0.4 m/s^2.
"""

LEAST_REGULARIZATION = 100.0
"""Ratio R/A below which the second term of the force is too large."""

ANY_DISTANCE = mujoco.mjMAXVAL
"""Margin (m) with which a contact is active at any distance."""


@dataclass(frozen=True)
class ViscousContact:
    """Viscous slip of a sphere on a plane: the force at the contact is -c V, V the slip velocity.

    The contact is a contact pair of the model. `add_to` adds the pair to a description of the
    model. `calibrate` sets its numbers in the compiled model, and `complete` in the description.
    The pair replaces the contact that the two geoms would otherwise have.

    Parameters
    ----------
    damping : float
        c in kg/s.
    sphere, plane : str
        Names of the geoms. The plane must not move.
    bears_load : bool
        Whether the contact also keeps the sphere from sinking into the plane. If not, joints or
        another contact pair must keep the sphere within 1 mm above the plane.
    name : str
        Name of the pair. Several viscous contacts in one model need different names.

    Raises
    ------
    ValueError
        `damping` is not a positive number, or another argument has the wrong type.

    Notes
    -----
    The law requires R >> A = 1/m + r^2/I, where m is the mass of the sphere's body, I its
    (smallest) moment of inertia and R the regularization of MuJoCo's contact. Two options of the
    model must be set:

    - `cone="elliptic"`;
    - `impratio`, tiny if the contact bears the load; the devices use 1e-10. This removes the
      Coulomb friction of the model's other contacts. For a contact that bears no load, 1 suffices.

    In single precision, a smaller value can overflow: if the contact bears the load, below 1e-11 in
    MuJoCo Warp and below 2e-7 in MJX; else below 0.1 in both.

    The contact also reduces the other accelerations of the slip by the fraction A/R. The error of c
    is up to A/R if the sphere's body is not free, its moments of inertia differ, or its center of
    mass is not the sphere's center; otherwise c is exact. For a solid ball, A/R is 3.5e4 `impratio`
    with load, and 3.5e-4 for `impratio` 1 without. `calibrate` rejects more than 0.01.

    A sphere that the contact bears settles critically damped, at a rate of 20/s. Under gravity
    alone, a free body rests with the sphere's center one radius above the plane; pulled up, it
    leaves the plane. The timestep must be shorter than 0.041 s, or 0.139 s with RK4
    (`magmotor.mjcf.viscous_contact.bearing_limit`). All of MuJoCo's integrators treat the force
    explicitly, so that a timestep h also requires c A h < 2, or 2.785 with RK4.

    Examples
    --------
    A ball slides on a table, and begins to roll as its slip decays.

    >>> import mujoco
    >>> import magmotor as mm
    >>> spec = mujoco.MjSpec.from_string('''
    ... <mujoco>
    ...   <option cone="elliptic" impratio="1e-10"/>
    ...   <worldbody>
    ...     <geom name="table" type="plane" size="1 1 1"/>
    ...     <body pos="0 0 0.05">
    ...       <freejoint/>
    ...       <geom name="ball" size="0.05" mass="0.2"/>
    ...     </body>
    ...   </worldbody>
    ... </mujoco>
    ... ''')
    >>> contact = mm.ViscousContact(damping=0.3, sphere="ball", plane="table")
    >>> contact.add_to(spec)
    >>> model = spec.compile()
    >>> contact.calibrate(model)
    >>> print(f"{contact.damping_of(model):.6f}")
    0.300000
    >>> data = mujoco.MjData(model)
    >>> data.qvel[0] = 0.7
    >>> mujoco.mj_step(model, data, nstep=5000)
    >>> print(data.qvel[[0, 4]].round(4))  # v = 5/7 of 0.7 m/s, omega = v/r
    [ 0.5 10. ]
    """

    damping: float
    sphere: str
    plane: str
    bears_load: bool = True
    name: str = "viscous"

    def __post_init__(self) -> None:
        check_number("damping", self.damping, above=0, unit="kg/s")
        for field in ("sphere", "plane", "name"):
            check_type(field, getattr(self, field), str)
        check_flag("bears_load", self.bears_load)

    def add_to(self, description: mujoco.MjSpec | model_parts.Element) -> None:
        """Add the contact pair, not yet calibrated, to a description of a model.

        Parameters
        ----------
        description : mujoco.MjSpec or dm_control.mjcf.RootElement

        Raises
        ------
        ValueError
            The description has the wrong type, or already has a pair of this name.
        """
        numbers = {
            "name": self.name,
            "condim": 3,
            "friction": [ALWAYS_IN_CONE, ALWAYS_IN_CONE, 0.005, 0.0001, 0.0001],
            "solreffriction": [0.0, -1.0],
            **(bearing(0.0) if self.bears_load else _normal(SOFT, FILM, WEAK)),
        }
        if isinstance(description, mujoco.MjSpec):
            description.add_pair(geomname1=self.plane, geomname2=self.sphere, **numbers)
        else:
            pairs = _root(description).contact
            pairs.add("pair", geom1=self.plane, geom2=self.sphere, **numbers)

    def calibrate(self, model: mujoco.MjModel) -> None:
        """Set the pair's numbers in a compiled model, so that its force is -c V.

        This sets `pair_solreffriction` to (0, -b) with b = c d (A + R). If the contact bears the
        load, it also sets `pair_margin` such that the resting sphere's center is one radius above
        the plane under the model's gravity. Calibrate again after changing masses, sizes, gravity
        or `impratio`.

        Parameters
        ----------
        model : mujoco.MjModel

        Raises
        ------
        ValueError
            The model has no such pair or cannot realize its law. The message names the element and
            the requirement.
        """
        pair, normal, ratio = self._in(model)
        model.pair_solreffriction[pair] = 0.0, -self.damping * ratio
        if self.bears_load:
            model.pair_margin[pair] = _resting_depth(_load(model, normal))

    def complete(self, description: mujoco.MjSpec | model_parts.Element) -> None:
        """Write the numbers that `calibrate` sets into a description that has the pair.

        The description is compiled once to compute them. Its XML, and models compiled from it
        later, contain the numbers; `MjSpec.to_xml` prints six digits.

        Parameters
        ----------
        description : mujoco.MjSpec or dm_control.mjcf.RootElement

        Raises
        ------
        ValueError
            As for `calibrate`, or the description does not compile.
        """
        if isinstance(description, mujoco.MjSpec):
            model, pair = description.compile(), description.pair(self.name)
        else:
            root = _root(description)
            model, pair = model_parts.compiled(root), root.find("contact", self.name)
        self.calibrate(model)
        number = number_of(model, "pair", self.name)
        pair.solreffriction = model.pair_solreffriction[number]
        pair.margin = model.pair_margin[number]

    def damping_of(self, model: mujoco.MjModel) -> float:
        """Return the damping c, in kg/s, of the contact in a compiled model in its current state.

        Parameters
        ----------
        model : mujoco.MjModel

        Raises
        ------
        ValueError
            As for `calibrate`.
        """
        pair, _, ratio = self._in(model)
        return float(-model.pair_solreffriction[pair, 1] / ratio)

    def _in(self, model: mujoco.MjModel) -> tuple[int, Array, float]:
        """Return the number of the pair, the normal of its contact at `qpos0`, and b/c."""
        check_type("model", model, mujoco.MjModel)
        pair = number_of(model, "pair", self.name)
        if pair < 0:
            raise InputError(
                f"pair {self.name!r} is not in the model: add it to the description with `add_to`"
                " before compiling the model"
            )
        geoms = {model.pair_geom1[pair], model.pair_geom2[pair]}
        if geoms != {number_of(model, "geom", name) for name in (self.sphere, self.plane)}:
            own = " and ".join(label(model, "geom", geom) for geom in sorted(geoms))
            sentence = f"must be the pair of {self.sphere!r} and {self.plane!r}"
            raise ArgumentError(f"pair {self.name!r}", own, sentence)
        sphere = check_pair(model, pair)
        if disabled(model, "contact"):
            raise ArgumentError(
                "flag contact", "disable", "must be 'enable', as the flag constraint"
            )
        near = copy(model)
        near.pair_margin[pair] = ANY_DISTANCE
        data = mujoco.MjData(near)
        mujoco.mj_fwdPosition(near, data)
        active = [c for c in data.contact if c.includemargin == ANY_DISTANCE and c.efc_address >= 0]
        if not active:
            raise ArgumentError(f"body of sphere {self.sphere!r}", "fixed", "must be able to move")
        inverse_inertia = _inverse_inertia(model, sphere)
        ratio = resistance(data, active[0], inverse_inertia)
        # Among the directions of the slip, that of the smallest moment has the largest error.
        worst = _inverse_inertia(model, sphere, np.min)
        regularization = (ratio / active[0].solimp[0] - inverse_inertia) / worst
        if regularization < LEAST_REGULARIZATION:
            largest = model.opt.impratio * regularization / LEAST_REGULARIZATION
            sentence = f"must be at most {largest:.2g}, so that R >= {LEAST_REGULARIZATION:g} A"
            raise ArgumentError("option impratio", model.opt.impratio, sentence)
        return pair, active[0].frame[:3].copy(), ratio  # contacts end with their mjData


def viscous_contacts(data: mujoco.MjData) -> list[Any]:
    """Return the active viscous contacts."""
    return [contact for contact in data.contact if contact.friction[0] == ALWAYS_IN_CONE]


def resistance(data: mujoco.MjData, contact: Any, inverse_inertia: float) -> float:
    """Return the ratio b/c = d (A + R) of a viscous contact."""
    regularization = float(data.efc_R[contact.efc_address + 1])
    return contact.solimp[0] * (inverse_inertia + regularization)


def check_pair(model: mujoco.MjModel, pair: int) -> int:
    """Check that a pair is a viscous contact of a sphere on a fixed plane, and return the sphere.

    Raises
    ------
    ValueError
        The message names the geoms and the requirement.
    """
    geoms = [int(model.pair_geom1[pair]), int(model.pair_geom2[pair])]
    plane, sphere = sorted(geoms, key=lambda geom: model.geom_type[geom])
    names = " and ".join(label(model, "geom", geom) for geom in (plane, sphere))
    kinds = [mujoco.mjtGeom(model.geom_type[geom]).name[7:].lower() for geom in (plane, sphere)]
    fixed = model.body_weldid[model.geom_bodyid[plane]] == 0
    if kinds != ["plane", "sphere"] or not fixed:
        raise ArgumentError(f"{names}: types", kinds, "must be a fixed plane and a sphere")
    dimension, friction = int(model.pair_dim[pair]), float(model.pair_friction[pair, 0])
    solimp, solref = model.pair_solimp[pair].tolist(), model.pair_solreffriction[pair].tolist()
    cone = mujoco.mjtCone(model.opt.cone).name[7:].lower()
    in_cone = (dimension, friction, cone) == (3, ALWAYS_IN_CONE, "elliptic")
    if not in_cone or solimp[0] != solimp[1] or solref[0] != 0 or solref[1] >= 0:
        law = f"condim {dimension}, friction {friction:g}, solimp {solimp}, solreffriction {solref}"
        sentence = (
            f"a viscous contact must have condim 3, friction {ALWAYS_IN_CONE:g}, solreffriction"
            ' "0 -b", a constant solimp and an elliptic cone'
        )
        raise ArgumentError(f"contact of {names}", f"{law}, cone {cone}", sentence)
    return sphere


def bearing(load: float) -> dict[str, Any]:
    """Return `solref`, `solimp` and `margin` of a contact that bears a load, in m/s^2."""
    return _normal(STIFF, _resting_depth(load))


def bearing_limit(integrator: str) -> float:
    """Return the timestep, in s, at which a contact that bears a body becomes unstable."""
    return (2.785 if integrator == "rk4" else 2 * math.sqrt(2) - 2) / CONTACT_RATE


def _normal(impedance: float, margin: float, share: float = 1.0) -> dict[str, Any]:
    return {
        "solref": [-share * STIFFNESS, -share * NORMAL_DAMPING],
        "solimp": [impedance, impedance, 0.001, 0.5, 2.0],
        "margin": margin,
    }


def _resting_depth(load: float) -> float:
    """Return how far a resting body sinks in; with a margin of this depth, it rests at z = r.

    At rest, the reference acceleration, (stiffness/d) depth, is g (1 - d)/d.
    """
    return load * (1 - STIFF) / STIFFNESS


def _load(model: mujoco.MjModel, normal: Array) -> float:
    """Return the component of gravity, in m/s^2, that presses the sphere onto the plane."""
    if disabled(model, "gravity"):
        return 0.0
    return max(0.0, float(-(model.opt.gravity @ normal)))


def _inverse_inertia(model: mujoco.MjModel, sphere: int, choose: Any = np.median) -> float:
    """Return A = 1/m + r^2/I of the sphere's body as if it were free, with I one of its moments."""
    body = model.geom_bodyid[sphere]
    offset = float(np.linalg.norm(model.geom_pos[sphere] - model.body_ipos[body]))
    name = label(model, "body", body)
    mass = check_number(f"{name}: mass", model.body_mass[body], above=0, unit="kg")
    moment = float(choose(model.body_inertia[body]))
    inertia = check_number(f"{name}: moment of inertia", moment, above=0, unit="kg m^2")
    return 1 / mass + (float(model.geom_size[sphere, 0]) + offset) ** 2 / inertia


def _root(description: Any) -> model_parts.Element:
    """Check that a description is the root of a PyMJCF tree, and return it."""
    if not hasattr(description, "contact"):
        raise ArgumentError(
            "description", description, "must be an MjSpec or the root of a PyMJCF tree"
        )
    return description
