"""What of the motor is only seen: both rings and the view."""

import numpy as np

from magmotor.engines.mujoco import parts
from magmotor.engines.mujoco.ring_looks import draw_ring, size_arrows
from magmotor.engines.mujoco.stage_looks import fit_stage
from magmotor.scenes import Motor
from magmotor.scenes.ring import ring_dipoles


def decorate(root: parts.Element, scene: Motor) -> None:
    """Draw the rings and fit lights and cameras to a scene."""
    size_arrows(root, scene.inner_radius * min(1.0, 20 / scene.inner_dipoles))
    draw_ring(root, "inner_ring", *scene.inner_dipole_frame())
    outer = ring_dipoles(scene.outer_dipoles, scene.outer_radius)
    draw_ring(root, "outer_ring", *outer)
    _mark(root, scene.inner_radius)
    highest = max(scene.inner_height, scene.outer_height)
    widest = max(scene.inner_radius, scene.outer_radius)
    extent = np.hypot(1.15 * widest, 0.5 * highest)
    fit_stage(root, [0.0, 0.0, highest / 2], extent)


def _mark(root: parts.Element, radius: float) -> None:
    """Mark the inner ring's first dipole, so that its yaw is seen."""
    bead = root.find("geom", "inner_mark")
    bead.pos, bead.size = [radius, 0.0, 0.0], radius * bead.size
