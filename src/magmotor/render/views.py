"""Views: renderings of the decorated model in a recorded pose by its cameras."""

from collections.abc import Mapping
from contextlib import ExitStack, closing

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import Scene
from magmotor.mjcf.lookup import number_of
from magmotor.render.camera import Camera, Image, open_camera
from magmotor.render.trail import Trail
from magmotor.run.in_mujoco import build


class Views:
    """Pictures of a scene, with one `Camera` for each name; call `close` at the end.

    Parameters
    ----------
    scene : Scene
    sizes : mapping of str to (int, int)
        Height and width in pixels by the name of each camera used.

    Raises
    ------
    ValueError
        The scene's model lacks a camera; the message names it.
    NoOpenGL
        No OpenGL context can be created.
    """

    def __init__(self, scene: Scene, sizes: Mapping[str, tuple[int, int]]):
        self.scene = scene
        self.model = build(scene, visual=True)
        for camera in sizes:
            check_has(self.model, scene, "camera", camera)
        self.data = mujoco.MjData(self.model)
        self.cameras: dict[str, Camera] = {}
        buffer = self.model.vis.global_
        with ExitStack() as stack:
            for name, (height, width) in sizes.items():
                buffer.offheight, buffer.offwidth = height, width
                camera = open_camera(self.model, name, height, width)
                self.cameras[name] = stack.enter_context(closing(camera))
            self.opened = stack.pop_all()

    def pose(self, joints: NDArray[np.float64], time: float = 0.0) -> None:
        """Set the pose at a time (s): joints, and bodies with prescribed motion."""
        self.data.qpos[:] = joints
        self.scene.device.place(self.scene, self.data, time)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def draw(self, camera: str, trail: Trail | None = None, until: float = 0.0) -> Image:
        """Render the pose by a camera, with the trail up to a time; shape (height, width, 3)."""
        return self.cameras[camera].draw(self.data, trail, until)

    def close(self) -> None:
        """Free the OpenGL contexts."""
        self.opened.close()


def check_has(model: mujoco.MjModel, scene: Scene, kind: str, name: str) -> None:
    """Check that a scene's model has a named camera or geom.

    Raises
    ------
    ValueError
        It does not; the message has the name.
    """
    if number_of(model, kind, name) < 0:
        raise ArgumentError(
            kind, name, f"the model of a {type(scene).__name__} must have this {kind}"
        )
