"""The ball on its plane as MJCF, with a scene's parameters; top and motor have it."""

from collections.abc import Sequence

from magmotor.engines.mujoco import parts
from magmotor.scenes import Motor, Top


def add_ball(root: parts.Element, scene: Top | Motor, inertia: Sequence[float]) -> None:
    """Give the ball its mass, size, moment and joints; `inertia` in kg m^2."""
    root.option.gravity = [0.0, 0.0, -scene.gravity]
    _resize(root, scene.ball_radius)
    body = root.find("body", "ball")
    body.pos = [0.0, 0.0, scene.ball_radius]
    body.add("inertial", pos=[0, 0, 0], mass=scene.ball_mass, diaginertia=inertia)
    root.find("site", "ball").user = [scene.moment]
    if scene.surface == "plane":
        body.add("freejoint", name="free")
    else:
        body.add("joint", name="x", type="slide", axis=[1, 0, 0])
        body.add("joint", name="y", type="slide", axis=[0, 1, 0])
        body.add("joint", name="orientation", type="ball")


def _resize(root: parts.Element, radius: float) -> None:
    """Scale the sphere, what decorates it, and the camera that follows it."""
    body = root.find("body", "ball")
    scale = radius / root.find("geom", "ball").size[0]
    for element in [*body.geom, *body.camera]:
        if element.pos is not None:
            element.pos = scale * element.pos
        if element.tag == "geom" and element.size is not None:
            element.size = scale * element.size
        if element.tag == "geom" and element.mesh is not None:
            element.mesh.scale *= scale
    root.find("geom", "ball").size = [radius]  # to the bit
