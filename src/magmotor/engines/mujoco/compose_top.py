"""Hamel's top as MJCF: ball, ring and stage, with a scene's parameters."""

import numpy as np

from magmotor.engines.mujoco import contact, parts
from magmotor.engines.mujoco.coordinates import BallCoordinates
from magmotor.engines.state import start
from magmotor.scenes import Top


def compose_top(scene: Top, *, looks: bool) -> parts.Element:
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
        contact.tune_solver(root, scene)
    coordinates = BallCoordinates(scene.surface, scene.ball_radius)
    qpos, qvel = coordinates.joints(start(scene))
    root.keyframe.add("key", name="start", qpos=qpos, qvel=qvel)
    contact.calibrate_viscous(root, scene)
    return root


def _shape_ball(root: parts.Element, scene: Top) -> None:
    body = root.find("body", "ball")
    scale = scene.ball_radius / root.find("geom", "ball").size[0]
    for element in [*body.geom, *body.camera]:
        if element.pos is not None:
            element.pos = scale * element.pos
        if element.tag == "geom" and element.size is not None:
            element.size = scale * element.size
    for name in ("ball_shaft", "ball_tip"):
        root.find("mesh", name).scale *= scale
    root.find("site", "ball").user = [scene.moment]
    body.pos = [0.0, 0.0, scene.ball_radius]
    body.add("inertial", pos=[0, 0, 0], mass=scene.ball_mass, diaginertia=scene.inertia)


def _free_ball(body: parts.Element, scene: Top) -> None:
    if scene.surface == "plane":
        body.add("freejoint", name="free")
    else:
        body.add("joint", name="x", type="slide", axis=[1, 0, 0])
        body.add("joint", name="y", type="slide", axis=[0, 1, 0])
        body.add("joint", name="orientation", type="ball")


def _place_ring(root: parts.Element, scene: Top) -> None:
    body = root.find("body", "ring")
    height, tilt = scene.ring_pose(0.0)
    body.pos = [0.0, 0.0, height]
    body.quat = scene.ring_quaternion(tilt)
    vertices, faces = _hoop(scene.ring_radius, 0.01 * scene.ring_radius)
    hoop = root.asset.add("mesh", name="hoop", vertex=vertices, face=faces, smoothnormal=True)
    body.add("geom", name="hoop", dclass="visual", type="mesh", mesh=hoop, material="hoop")
    shaft, tip = root.find("mesh", "ring_shaft"), root.find("mesh", "ring_tip")
    for mesh in (shaft, tip):
        mesh.scale *= scene.ring_radius * min(1.0, 20 / scene.ring_dipoles)
    for i, (position, outward) in enumerate(zip(*scene.ring_dipole_frame(), strict=True)):
        body.add(
            "site",
            name=f"ring{i}",
            dclass="dipole",
            pos=position,
            zaxis=outward,
            user=[scene.moment],
        )
        body.add("geom", dclass="arrow", mesh=shaft, pos=position, zaxis=outward)
        end = position + (shaft.scale[2] + tip.scale[2] / 2) * outward
        body.add("geom", dclass="arrow", mesh=tip, pos=end, zaxis=outward)


def _hoop(radius: float, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a thin torus, with far fewer of them than MuJoCo's own."""
    around, across = np.indices((96, 6))
    u, v = 2 * np.pi * around / 96, 2 * np.pi * across / 6
    outward = radius + thickness * np.cos(v)
    points = np.stack([outward * np.cos(u), outward * np.sin(u), thickness * np.sin(v)], axis=-1)
    index = np.arange(96 * 6).reshape(96, 6)
    ahead, up = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    both = np.roll(ahead, -1, axis=1)
    triangles = np.stack([index, ahead, both, index, both, up], axis=-1)
    return points.ravel(), triangles.ravel()


def _frame(root: parts.Element, scene: Top) -> None:
    """Fit floor, lights and cameras, which are set for the default scene, to this one."""
    highest = max([height for _, height, _ in scene.ring_script] or [scene.ring_height])
    centre = np.array([0.0, 0.0, highest / 2])
    extent = np.hypot(1.15 * scene.ring_radius, 0.5 * highest)
    statistic, world = root.statistic, root.worldbody
    zoom = extent / statistic.extent
    for element in [*world.light, *world.camera]:
        element.pos = centre + zoom * (element.pos - statistic.center)
    floor = root.find("geom", "floor")
    floor.size = zoom * floor.size
    statistic.center, statistic.extent = centre, extent
