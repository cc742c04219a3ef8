"""The paper's viscous slip law realised by a frictional contact, and dry friction beside it.

A contact with an elliptic cone that is never reached, and friction rows that are purely damped
(`solreffriction="0 -b"`), has the friction force f = -(b/d) V/(A + R) - a0/(A + R): V is the slip
velocity, a0 the slip acceleration without friction, A = 1/m + r^2/I the inverse inertia at the
contact, d the impedance and R the regularisation. Where R >> A the second term is negligible, and
b = c d (A + R) gives f = -c V. A tiny `impratio` makes R huge in a contact that bears the load;
dry friction needs `impratio` 1, so there a second contact carries the viscous law, with the
smallest impedance (R = 1e4 A) and next to none of the load.

Dry friction is regularised: it grows with the slip up to v* = mu N A/rate, where it saturates.
A ball that it holds creeps by 1e-4 of that.
MuJoCo's convex cone makes a slipping ball press harder, by a fraction of mu^2 V/v*, and hop a
little; the mean friction over some steps stays mu m g.
"""

import math
from typing import Any

import mujoco

from magmotor.common.checks import check_number
from magmotor.mjcf import parts

DRY_FRICTION_RATE = 200.0
"""Rate (1/s) at which dry friction that is not saturated stops a slip; a step must be shorter."""

CONTACT_RATE = 20.0
"""Rate (1/s) at which a ball that the plane bears comes to rest on it, critically damped."""

BEARING = {"rk4": 2.785 / CONTACT_RATE}
"""Step (s) at which the bearing contact of a plane becomes unstable; else (2 sqrt 2 - 2)/rate."""

STIFF, SOFT = 0.9999, 0.0001
"""MuJoCo's largest and smallest impedance d."""

STIFFNESS, DAMPING = CONTACT_RATE**2, 2 * CONTACT_RATE
"""Of the contact's normal, over mass, in 1/s^2 and 1/s."""

ALWAYS_IN_CONE = 1e6
"""Friction coefficient of the viscous contact, so large that its cone is never reached."""

FILM = 1e-3
"""Margin (m) within which a contact that need not bear the load is active, its point at -r e_z."""


def add_contacts(
    root: parts.Element,
    surface: str,
    gravity: float,
    friction: float,
    dry_friction: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Add the contact pairs of the ball on the floor; `calibrate_viscous` completes them."""
    dry = any(dry_friction)
    viscous_bears_load = surface == "plane" and not dry
    root.option.impratio = 1.0 if dry else 1e-14
    bearing = {"solimp": _constant(STIFF), "margin": _resting_depth(gravity)}
    common = {"geom1": "floor", "geom2": "ball", "solref": [-STIFFNESS, -DAMPING], **bearing}
    if dry:
        slide, turn, roll = dry_friction
        root.contact.add(
            "pair",
            name="dry",
            condim=6 if roll else 4 if turn else 3,
            friction=[slide, slide, turn, roll, roll],
            solreffriction=[0.0, -DRY_FRICTION_RATE],
            **common,
        )
    elif friction == 0 and surface == "plane":
        root.contact.add("pair", name="smooth", condim=1, **common)
    if friction > 0:
        add_viscous(root, "ball", **(bearing if viscous_bears_load else {}))


def add_viscous(root: parts.Element, geom: str, **bearing: Any) -> None:
    """Add the viscous contact of a geom with the floor, bearing no load unless told how."""
    film = {"solimp": _constant(SOFT), "margin": FILM}
    root.contact.add(
        "pair",
        name="viscous",
        geom1="floor",
        geom2=geom,
        condim=3,
        friction=[ALWAYS_IN_CONE, ALWAYS_IN_CONE, 0.005, 0.0001, 0.0001],
        solref=[-STIFFNESS, -DAMPING],
        solreffriction=[0.0, -1.0],
        **(bearing or film),
    )


def tune_solver(root: parts.Element, surface: str, friction: float) -> None:
    """Have the solver do no more than the ball's contacts need.

    On the plane, Newton's first step along each line is as good as those that its line search
    would add.
    """
    if surface == "plane":
        root.option.ls_tolerance = 1e6
    elif friction == 0:
        root.option.flag.constraint = "disable"
    else:
        solve_in_one_step(root)


def solve_in_one_step(root: parts.Element) -> None:
    """Take one step of conjugate gradients: exact with R >> A and no normal dynamics.

    The tolerance is zero, so that it is taken at any slip.
    """
    root.option.set_attributes(solver="CG", iterations=1, ls_iterations=1, tolerance=0)


def calibrate_viscous(root: parts.Element, friction: float, inverse_inertia: float) -> None:
    """Set b so that the viscous contact's force is -c V, c = `friction` and A = `inverse_inertia`.

    R is read from the compiled model.
    """
    pair = root.find("contact", "viscous")
    if pair is None:
        return
    model = parts.compiled(root)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    (contact,) = viscous_contacts(data)
    pair.solreffriction = [0.0, -friction * _resistance(data, contact, inverse_inertia)]


def viscous_contacts(data: mujoco.MjData) -> list[Any]:
    """The viscous ones among the contacts that are active."""
    return [contact for contact in data.contact if contact.friction[0] == ALWAYS_IN_CONE]


def viscous_friction(data: mujoco.MjData, contact: Any, inverse_inertia: float) -> float:
    """The c of a viscous contact, whose force is -c V; see `calibrate_viscous`."""
    return -contact.solreffriction[1] / _resistance(data, contact, inverse_inertia)


def _resistance(data: mujoco.MjData, contact: Any, inverse_inertia: float) -> float:
    """How many times larger than its c the b of a viscous contact is: d (A + R)."""
    regularisation = data.efc_R[contact.efc_address + 1]
    return contact.solimp[0] * (inverse_inertia + regularisation)


def _resting_depth(gravity: float) -> float:
    """How far a resting ball sinks in, so that a margin of this depth lets it rest at z = r.

    At rest the constraint's reference acceleration k (depth) is g (1 - d)/d, and k is the
    stiffness over d.
    """
    return gravity * (1 - STIFF) / STIFFNESS


def _constant(impedance: float) -> list[float]:
    return [impedance, impedance, 0.001, 0.5, 2.0]


def bearing_limit(method: str) -> float:
    """Step, in s, at which the contact that bears a ball on a plane becomes unstable."""
    return BEARING.get(method.split("/")[1], (2 * math.sqrt(2) - 2) / CONTACT_RATE)


def check_bearing_limit(method: str, timestep: float) -> None:
    """Check a timestep against the contact that bears a ball on a plane.

    Raises
    ------
    ValueError
        Names the timestep and the limit.
    """
    limit = bearing_limit(method)
    check_number("timestep", timestep, below=limit, unit="s on a plane that bears the ball")
