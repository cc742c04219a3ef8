"""Hamel's top as MJCF: ball, ring and stage, with a scene's parameters."""

from typing import TYPE_CHECKING

import numpy as np

from magmotor.engines.mujoco import contact, parts
from magmotor.engines.mujoco.coordinates import BallCoordinates
from magmotor.engines.state import start
from magmotor.scenes import Top

if TYPE_CHECKING:
    from dm_control import mjcf


def compose_top(scene: Top, *, looks: bool) -> "mjcf.RootElement":
    """The top as one PyMJCF tree, without decoration unless `looks`."""
    root = parts.load("top")
    root.option.gravity = [0.0, 0.0, -scene.gravity]
    _shape_ball(root, scene)
    _free_ball(root.find("body", "ball"), scene)
    _place_ring(root, scene)
    contact.add_contacts(root, scene)
    if looks:
        _frame(root, scene)
    else:
        parts.strip(root)
    coordinates = BallCoordinates(scene.surface, scene.ball_radius)
    qpos, qvel = coordinates.joints(start(scene))
    root.keyframe.add("key", name="start", qpos=qpos, qvel=qvel)
    contact.calibrate_viscous(root, scene)
    return root


def _shape_ball(root: "mjcf.RootElement", scene: Top) -> None:
    body = root.find("body", "ball")
    scale = scene.ball_radius / root.find("geom", "ball").size[0]
    for element in [*body.geom, *body.camera]:
        if element.pos is not None:
            element.pos = scale * element.pos
        if element.tag == "geom" and element.size is not None:
            element.size = scale * element.size
    root.find("mesh", "ball_tip").scale *= scale
    root.find("site", "ball").user = [scene.moment]
    body.pos = [0.0, 0.0, scene.ball_radius]
    body.add("inertial", pos=[0, 0, 0], mass=scene.ball_mass, diaginertia=scene.inertia)


def _free_ball(body: "mjcf.Element", scene: Top) -> None:
    if scene.surface == "plane":
        body.add("freejoint", name="free")
    else:
        body.add("joint", name="x", type="slide", axis=[1, 0, 0])
        body.add("joint", name="y", type="slide", axis=[0, 1, 0])
        body.add("joint", name="orientation", type="ball")


def _place_ring(root: "mjcf.RootElement", scene: Top) -> None:
    body = root.find("body", "ring")
    height, tilt = scene.ring_pose(0.0)
    body.pos = [0.0, 0.0, height]
    body.quat = scene.ring_quaternion(tilt)
    scale = scene.ring_radius * min(1.0, 20 / scene.ring_dipoles)
    root.find("mesh", "hoop").scale = [scene.ring_radius] * 3
    root.find("mesh", "ring_tip").scale *= scale
    thickness, half = 0.012 * scale, 0.055 * scale
    for i, (position, outward) in enumerate(zip(*scene.ring_dipole_frame(), strict=True)):
        place = {"pos": position, "zaxis": outward}
        body.add("site", name=f"ring{i}", dclass="dipole", user=[scene.moment], **place)
        body.add("geom", dclass="arrow", size=[thickness, half], **place)
        tip = {"pos": position + half * outward, "zaxis": outward}
        body.add("geom", dclass="arrow", type="mesh", mesh="ring_tip", **tip)


def _frame(root: "mjcf.RootElement", scene: Top) -> None:
    """Let the stage's cameras, set for the default scene, see all of this one."""
    highest = max([height for _, height, _ in scene.ring_script] or [scene.ring_height])
    statistic = root.statistic
    reference, extent = statistic.center, statistic.extent
    statistic.center = [0.0, 0.0, highest / 2]
    statistic.extent = np.hypot(1.15 * scene.ring_radius, highest / 2)
    zoom = statistic.extent / extent
    for camera in root.worldbody.camera:
        camera.pos = statistic.center + zoom * (camera.pos - reference)
