"""What of Hamel's top is only seen: the ring and the view."""

import numpy as np

from magmotor.engines.mujoco import parts
from magmotor.engines.mujoco.ring_looks import draw_ring, size_arrows
from magmotor.engines.mujoco.stage_looks import fit_stage
from magmotor.scenes import Top


def decorate(root: parts.Element, scene: Top) -> None:
    """Draw the ring and fit lights and cameras to a scene."""
    size_arrows(root, scene.ring_radius * min(1.0, 20 / scene.ring_dipoles))
    draw_ring(root, "ring", *scene.ring_dipole_frame())
    highest = max([height for _, height, _ in scene.ring_script] or [scene.ring_height])
    extent = np.hypot(1.15 * scene.ring_radius, 0.5 * highest)
    fit_stage(root, [0.0, 0.0, highest / 2], extent)
