"""What of a ring of dipoles is only seen: its hoop, and an arrow for each dipole."""

import numpy as np

from magmotor.engines.mujoco import parts


def size_arrows(root: parts.Element, scale: float) -> None:
    """Scale the arrows of all rings."""
    for name in ("ring_shaft", "ring_tip"):
        root.find("mesh", name).scale *= scale


def draw_ring(root: parts.Element, name: str, positions: np.ndarray, outward: np.ndarray) -> None:
    """Draw the ring that a body is, in the material of its name; dipoles (N, 3) in its frame."""
    body = root.find("body", name)
    radius = float(np.linalg.norm(positions[0]))
    vertices, faces = _hoop(radius, 0.01 * radius)
    hoop = root.asset.add("mesh", name=name, vertex=vertices, face=faces, smoothnormal=True)
    body.add("geom", name=name, dclass="visual", type="mesh", mesh=hoop, material=name)
    shaft, tip = root.find("mesh", "ring_shaft"), root.find("mesh", "ring_tip")
    for position, direction in zip(positions, outward, strict=True):
        body.add("geom", dclass="arrow", mesh=shaft, pos=position, zaxis=direction)
        end = position + (shaft.scale[2] + tip.scale[2] / 2) * direction
        body.add("geom", dclass="arrow", mesh=tip, pos=end, zaxis=direction)


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
