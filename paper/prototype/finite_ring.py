"""A ring of finite magnets in place of its dipoles, as sources of a field and as a MuJoCo model."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.devices.top.scene import Top
from magmotor.mjcf.magnetism import magnetism
from magmotor.run.in_mujoco import compose
from paper.prototype.magnet_shapes import Cloud

Array = NDArray[np.float64]

TIMESTEP, INTERVAL = 0.025, 0.1
"""Of runs, and between what they record, in s."""


def frame_sources(scene: Top, magnet: Cloud) -> tuple[Array, Array]:
    """Positions (n, 3) and moments (n, 3) of the ring's magnets, in the ring's own frame.

    Each magnet's x axis is outward, its z axis the ring's.
    """
    points, parts = magnet
    places, outward = scene.ring_dipole_frame()
    axis = np.broadcast_to([0.0, 0.0, 1.0], outward.shape)
    turns = np.stack([outward, np.cross(axis, outward), axis], axis=1)
    positions = places[:, None] + points @ turns
    moments = scene.moment * parts[:, None] * outward[:, None]
    return positions.reshape(-1, 3), moments.reshape(-1, 3)


def sources(scene: Top, magnet: Cloud) -> tuple[Array, Array]:
    """The same in the world's frame, in m and A m^2."""
    return scene.in_world(*frame_sources(scene, magnet))


def build(scene: Top, magnet: Cloud) -> mujoco.MjModel:
    """The scene's model with these magnets on its ring."""
    spec = mujoco.MjSpec.from_string(compose(scene, looks=False).to_xml_string())
    ring, kind = spec.body("ring"), spec.find_default("dipole")
    for site in ring.sites:
        spec.delete(site)
    for position, moment in zip(*frame_sources(scene, magnet), strict=True):
        size = float(np.linalg.norm(moment))
        site = ring.add_site(kind, pos=position, userdata=[size])
        site.alt.type = mujoco.mjtOrientation.mjORIENTATION_ZAXIS
        site.alt.zaxis = moment / size
    return spec.compile()


def momentum(scene: Top, model: mujoco.MjModel, duration: float) -> Array:
    """J in kg m^2/s every tenth of a second of a run by RK4, shape (T,)."""
    model.opt.timestep, model.opt.integrator = TIMESTEP, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    spin = np.zeros(round(duration / INTERVAL) + 1)
    with magnetism():
        for n in range(1, len(spin)):
            mujoco.mj_step(model, data, nstep=round(INTERVAL / TIMESTEP))
            spin[n] = data.qvel[-1]
    return scene.inertia[2] * spin
