"""The contacts of the ball on its plane: the paper's viscous slip, and dry friction beside it.

The plane bears the ball by one contact: dry friction, else viscous slip, else a smooth contact. Dry
friction needs `impratio` 1; there the viscous contact bears next to none of the load.

Dry friction is regularized: it grows with the slip up to v* = mu N A/rate, where it saturates.
A ball that it holds creeps by 1e-4 of that.
MuJoCo's convex cone makes a slipping ball press harder, by a fraction of mu^2 V/v*, and hop a
little; the mean friction over some steps stays mu m g.
"""

from magmotor.devices.ball.scene import BallScene
from magmotor.mjcf import parts
from magmotor.mjcf.viscous_contact import ViscousContact, bearing

DRY_FRICTION_RATE = 200.0
"""Rate (1/s) at which dry friction that is not saturated stops a slip; a step must be shorter."""


def add_contacts(
    root: parts.Element,
    scene: BallScene,
    friction: float,
    dry_friction: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Add the contact pairs of the ball on the floor to a tree that is otherwise complete."""
    on_plane, dry = scene.surface == "plane", any(dry_friction)
    root.option.impratio = 1.0 if dry else 1e-14
    common = {"geom1": "floor", "geom2": "ball", **bearing(scene.gravity)}
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
    elif friction == 0 and on_plane:
        root.contact.add("pair", name="smooth", condim=1, **common)
    if friction > 0:
        viscous = ViscousContact(friction, "ball", "floor", bears_load=on_plane and not dry)
        viscous.add_to(root)
        viscous.complete(root)


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
        parts.solve_in_one_step(root)
