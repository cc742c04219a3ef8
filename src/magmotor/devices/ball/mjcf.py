"""The parts of the MJCF models that top and motor share, with a scene's parameters."""

from collections.abc import Sequence

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.ball.scene import BallScene
from magmotor.mjcf import model_parts


def add_ball(root: model_parts.Element, scene: BallScene, inertia: Sequence[float]) -> None:
    """Set the mass, size, magnetic moment and joints of the ball; `inertia` in kg m^2."""
    root.option.gravity = scene.gravity_vector
    if any(scene.background_field):
        root.custom.add("numeric", name="field_background", data=scene.background_field)
    _resize(root, scene.ball_radius)
    body = root.find("body", "ball")
    body.add("inertial", pos=[0, 0, 0], mass=scene.ball_mass, diaginertia=inertia)
    root.find("site", "ball").user = [scene.moment]
    if scene.surface == "plane":
        body.add("freejoint", name="free")
    else:
        drag, rotational_drag = scene.drag or None, scene.rotational_drag or None
        body.add("joint", name="x", type="slide", axis=[1, 0, 0], damping=drag)
        body.add("joint", name="y", type="slide", axis=[0, 1, 0], damping=drag)
        body.add("joint", name="orientation", type="ball", damping=rotational_drag)


def mark(root: model_parts.Element, scene: BallScene, kinds: str) -> None:
    """Declare which user numbers, tuples and numerics of the model are magnetic or noise."""
    model_parts.mark(root, f"{kinds} fields" if any(scene.background_field) else kinds)


def start_ball(root: model_parts.Element, scene: BallScene, qpos: Array) -> None:
    """Make the ball's initial joint coordinates those of `qpos0`, with which viewers start.

    A ball joint cannot have a reference; there, the orientation stays that of the body.
    """
    body = root.find("body", "ball")
    if scene.surface == "plane":
        body.pos, body.quat = qpos[:3], qpos[3:7]
    else:
        body.pos = [*qpos[:2], scene.ball_radius]
        for name, coordinate in zip("xy", qpos[:2], strict=True):
            body.find("joint", name).ref = coordinate


def _resize(root: model_parts.Element, radius: float) -> None:
    """Scale the sphere, its decoration, and the camera that follows it."""
    body = root.find("body", "ball")
    scale = radius / root.find("geom", "ball").size[0]
    for element in [*body.geom, *body.camera]:
        if element.pos is not None:
            element.pos = scale * element.pos
        if element.tag == "geom" and element.size is not None:
            element.size = scale * element.size
        if element.tag == "geom" and element.mesh is not None:
            element.mesh.scale *= scale
    root.find("geom", "ball").size = [radius]  # exactly


def size_arrows(root: model_parts.Element, scale: float) -> None:
    """Scale the arrows of all rings."""
    for name in ("ring_shaft", "ring_tip"):
        root.find("mesh", name).scale *= scale


def draw_ring(
    root: model_parts.Element, name: str, positions: np.ndarray, outward: np.ndarray
) -> None:
    """Draw a ring with its dipoles (N, 3), given in its frame, in the material `name`."""
    body = root.find("body", name)
    radius = float(np.linalg.norm(positions[0]))
    torus = {"builtin": "supertorus", "params": [48, 0.01, 1, 1], "scale": 3 * [radius]}
    hoop = root.asset.add("mesh", name=name, **torus)
    body.add("geom", name=name, dclass="visual", type="mesh", mesh=hoop, material=name)
    shaft, tip = root.find("mesh", "ring_shaft"), root.find("mesh", "ring_tip")
    for position, direction in zip(positions, outward, strict=True):
        body.add("geom", dclass="arrow", mesh=shaft, pos=position, zaxis=direction)
        end = position + (shaft.scale[2] + tip.scale[2] / 2) * direction
        body.add("geom", dclass="arrow", mesh=tip, pos=end, zaxis=direction)
