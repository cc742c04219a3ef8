"""The top with finite magnets instead of dipoles on its ring: field sources and model."""

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.top.mjcf import compose_top
from magmotor.devices.top.scene import Top
from magmotor.numerics.magnet_shapes import Cloud, as_dipoles


def finite_ring_sources(scene: Top, magnet: Cloud) -> tuple[Array, Array]:
    """Return dipoles that represent the magnets on the ring, in the world frame.

    Parameters
    ----------
    scene : Top
        One magnet replaces each dipole of its ring and has the same moment.
    magnet : tuple of ndarray
        See `magmotor.numerics.magnet_shapes`. The x axis of the magnet points outward, its z axis
        along the axis of the ring.

    Returns
    -------
    positions : ndarray, shape (N, 3)
        In m.
    moments : ndarray, shape (N, 3)
        In A m^2.
    """
    return scene.in_world(*_on_ring(scene, magnet))


def build_finite_ring(scene: Top, magnet: Cloud) -> mujoco.MjModel:
    """Compile the scene's model with finite magnets on its ring; see `finite_ring_sources`."""
    spec = mujoco.MjSpec.from_string(compose_top(scene, visual=False).to_xml_string())
    ring, kind = spec.body("ring"), spec.find_default("dipole")
    for site in ring.sites:
        spec.delete(site)
    for position, moment in zip(*_on_ring(scene, magnet), strict=True):
        size = float(np.linalg.norm(moment))
        site = ring.add_site(kind, pos=position, userdata=[size])
        site.alt.type = mujoco.mjtOrientation.mjORIENTATION_ZAXIS
        site.alt.zaxis = moment / size
    return spec.compile()


def _on_ring(scene: Top, magnet: Cloud) -> tuple[Array, Array]:
    """Positions (N, 3) in m and moments (N, 3) in A m^2 in the ring's own frame."""
    positions, outward = scene.ring_dipole_frame()
    return as_dipoles(magnet, scene.moment, positions, outward, [0.0, 0.0, 1.0])
