"""What of Hamel's top is only seen: pattern and arrow of the ball, hoop and arrows, the view."""

import numpy as np

from magmotor.engines.mujoco import parts
from magmotor.engines.mujoco.stage_looks import fit_stage
from magmotor.scenes import Top


def decorate(root: parts.Element, scene: Top) -> None:
    """Fit the decoration, lights and cameras to a scene; the ball still has its default size."""
    _size_ball(root, scene.ball_radius / root.find("geom", "ball").size[0])
    _draw_ring(root, scene)
    _frame(root, scene)


def _size_ball(root: parts.Element, scale: float) -> None:
    body = root.find("body", "ball")
    sphere = root.find("geom", "ball")
    for element in [*body.geom, *body.camera]:
        if element.pos is not None:
            element.pos = scale * element.pos
        if element.tag == "geom" and element is not sphere and element.size is not None:
            element.size = scale * element.size
    for name in ("ball_shaft", "ball_tip"):
        root.find("mesh", name).scale *= scale


def _draw_ring(root: parts.Element, scene: Top) -> None:
    body = root.find("body", "ring")
    vertices, faces = _hoop(scene.ring_radius, 0.01 * scene.ring_radius)
    hoop = root.asset.add("mesh", name="hoop", vertex=vertices, face=faces, smoothnormal=True)
    body.add("geom", name="hoop", dclass="visual", type="mesh", mesh=hoop, material="hoop")
    shaft, tip = root.find("mesh", "ring_shaft"), root.find("mesh", "ring_tip")
    for mesh in (shaft, tip):
        mesh.scale *= scene.ring_radius * min(1.0, 20 / scene.ring_dipoles)
    for position, outward in zip(*scene.ring_dipole_frame(), strict=True):
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
    highest = max([height for _, height, _ in scene.ring_script] or [scene.ring_height])
    centre = np.array([0.0, 0.0, highest / 2])
    extent = np.hypot(1.15 * scene.ring_radius, 0.5 * highest)
    fit_stage(root, centre, extent)
