"""A device in its initial state, rendered by MuJoCo."""

from typing import TYPE_CHECKING

import mujoco

from magmotor.devices.disk.scene import Disk
from magmotor.devices.motor.scene import Motor
from magmotor.devices.top.scene import Top
from magmotor.render.views import Views

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE = (420, 560)
"""Height and width in pixels."""


def draw_device(axes: "Axes", scene: Top | Motor | Disk, camera: str) -> None:
    """Draw the scene from a camera."""
    views = Views(scene, {camera: SIZE})
    try:
        views.cameras[camera].scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = True
        views.pose(views.model.key_qpos[0])
        axes.imshow(views.draw(camera))
        axes.set_axis_off()
    finally:
        views.close()
