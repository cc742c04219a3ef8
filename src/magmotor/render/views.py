"""Views: the decorated model in a recorded pose, seen by its cameras."""

import os
import warnings
from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.device.device import Scene
from magmotor.render.trail import Trail
from magmotor.run.in_mujoco import build

Image = NDArray[np.uint8]


class NoOpenGL(RuntimeError):
    """No OpenGL library draws here: none is installed, or not the one that MUJOCO_GL names."""


class Views:
    """Pictures of a scene, each size drawn by a renderer of its own, to be closed at the end.

    Parameters
    ----------
    scene : Top, Motor or Disk
    sizes : mapping of str to (int, int)
        Height and width in pixels for the name of each camera that will be used: `front`, `top`,
        `ball` or `disk`.

    Raises
    ------
    NoOpenGL
        No OpenGL context can be made.
    """

    def __init__(self, scene: Scene, sizes: Mapping[str, tuple[int, int]]):
        self.scene = scene
        self.model = build(scene, visual=True)
        self.data = mujoco.MjData(self.model)
        self.renderers: dict[str, mujoco.Renderer] = {}
        buffer = self.model.vis.global_
        for camera, (height, width) in sizes.items():
            buffer.offheight, buffer.offwidth = height, width
            renderer = _open_renderer(self.model, height, width)
            renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = False  # no camera sees it
            self.renderers[camera] = renderer

    def pose(self, joints: NDArray[np.float64], time: float = 0.0) -> None:
        """Put everything where it is at a time (s): joints, and what moves on a script."""
        self.data.qpos[:] = joints
        self.scene.device.place(self.scene, self.data, time)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def draw(self, camera: str, trail: Trail | None = None, until: float = 0.0) -> Image:
        """The pose as a camera sees it, shape (height, width, 3), with the trail up to a time."""
        renderer = self.renderers[camera]
        renderer.update_scene(self.data, camera)
        if trail is not None:
            trail.add_to(renderer.scene, until)
        return renderer.render()

    def close(self) -> None:
        """Free the OpenGL contexts."""
        for renderer in self.renderers.values():
            renderer.close()


_failures: list[Exception] = []
"""Why there is no OpenGL, once that is known: a second try with GLFW would abort the process."""


def _open_renderer(model: mujoco.MjModel, height: int, width: int) -> mujoco.Renderer:
    if not _failures:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # GLFW warns of what is raised below
                return mujoco.Renderer(model, height, width)
        except (AttributeError, ImportError, RuntimeError, mujoco.FatalError) as error:
            # With MUJOCO_GL=disable it is AttributeError; where EGL has no display, ImportError;
            # where OSMesa has no context, RuntimeError; where GLFW finds no window system,
            # FatalError.
            _failures.append(error)
    asked = os.environ.get("MUJOCO_GL", "is not set")
    reason = f"MuJoCo finds no OpenGL to draw with (MUJOCO_GL={asked})"
    raise NoOpenGL(reason) from _failures[0]
