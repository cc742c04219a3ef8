"""Contacts of the ball with its plane: the paper's viscous slip, and optional dry friction.

One contact bears the ball: the one with dry friction, else the one with viscous slip, else a
frictionless one. Dry friction requires `impratio` 1; the viscous contact then bears almost no load.

Dry friction is regularized: it grows with the slip up to v* = mu N A/rate, where it saturates. A
ball at rest by dry friction creeps at 1e-4 of v*. MuJoCo's convex cone increases the normal force
of a slipping ball by a fraction of mu^2 V/v*, so that it hops slightly; the friction averaged over
a few steps is still mu m g.
"""

from magmotor.devices.ball.scene import BallScene
from magmotor.mjcf import model_parts
from magmotor.mjcf.viscous_contact import ViscousContact, bearing

DRY_FRICTION_RATE = 200.0
"""Rate (1/s) at which unsaturated dry friction stops a slip; its inverse limits the timestep."""


def add_contacts(
    root: model_parts.Element,
    scene: BallScene,
    friction: float,
    dry_friction: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Add the contact pairs of ball and floor to a tree that is otherwise complete."""
    on_plane, dry = scene.surface == "plane", any(dry_friction)
    root.option.impratio = 1.0 if dry else 1e-10
    common = {"geom1": "floor", "geom2": "ball", **bearing(scene.gravity)}
    if dry:
        sliding, torsional, rolling = dry_friction
        root.contact.add(
            "pair",
            name="dry",
            condim=6 if rolling else 4 if torsional else 3,
            friction=[sliding, sliding, torsional, rolling, rolling],
            solreffriction=[0.0, -DRY_FRICTION_RATE],
            **common,
        )
    elif friction == 0 and on_plane:
        root.contact.add("pair", name="smooth", condim=1, **common)
    if friction > 0:
        viscous = ViscousContact(friction, "ball", "floor", bears_load=on_plane and not dry)
        viscous.add_to(root)
        viscous.complete(root)


def tune_solver(root: model_parts.Element, surface: str, friction: float) -> None:
    """Set the solver to the least work that the ball's contacts need.

    On the plane, the first Newton step along each line is already as good as a line search.
    """
    if surface == "plane":
        root.option.ls_tolerance = 1e6
    elif friction == 0:
        root.option.flag.constraint = "disable"
    else:
        model_parts.solve_in_one_step(root)
