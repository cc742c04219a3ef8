"""Views: renderings of the decorated model in a recorded pose by its cameras."""

import warnings
from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import reject
from magmotor.common.environment import gl_setting
from magmotor.device.device import Scene
from magmotor.mjcf.lookup import number_of
from magmotor.render.trail import Trail
from magmotor.run.in_mujoco import build

Image = NDArray[np.uint8]


class NoOpenGL(RuntimeError):
    """No OpenGL library is available, or not the one that MUJOCO_GL names."""


class Views:
    """Pictures of a scene, with one renderer per camera; call `close` at the end.

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
        self.renderers: dict[str, mujoco.Renderer] = {}
        buffer = self.model.vis.global_
        for camera, (height, width) in sizes.items():
            buffer.offheight, buffer.offwidth = height, width
            renderer = _open_renderer(self.model, height, width)
            renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = False  # no camera sees it
            # The ring's shadow would look like a second ring, and costs more than all the rest.
            renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
            self.renderers[camera] = renderer

    def pose(self, joints: NDArray[np.float64], time: float = 0.0) -> None:
        """Set the pose at a time (s): joints, and bodies with prescribed motion."""
        self.data.qpos[:] = joints
        self.scene.device.place(self.scene, self.data, time)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def draw(self, camera: str, trail: Trail | None = None, until: float = 0.0) -> Image:
        """Render the pose by a camera, with the trail up to a time; shape (height, width, 3)."""
        renderer = self.renderers[camera]
        renderer.update_scene(self.data, camera)
        if trail is not None:
            trail.add_to(renderer.scene, until)
        return renderer.render()

    def close(self) -> None:
        """Free the OpenGL contexts."""
        for renderer in self.renderers.values():
            renderer.close()


def check_has(model: mujoco.MjModel, scene: Scene, kind: str, name: str) -> None:
    """Check that a scene's model has a named camera or geom.

    Raises
    ------
    ValueError
        It does not; the message has the name.
    """
    if number_of(model, kind, name) < 0:
        raise reject(kind, name, f"the model of a {type(scene).__name__} must have this {kind}")


_failures: list[Exception] = []
"""The first failure to open OpenGL, kept since a second try with GLFW would abort the process."""


def _open_renderer(model: mujoco.MjModel, height: int, width: int) -> mujoco.Renderer:
    if not _failures:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # GLFW also warns of the error
                return mujoco.Renderer(model, height, width)
        except (AttributeError, ImportError, RuntimeError, mujoco.FatalError) as error:
            # AttributeError: MUJOCO_GL=disable. ImportError: EGL without a display. RuntimeError:
            # OSMesa without a context. FatalError: GLFW without a window system.
            _failures.append(error)
    reason = f"MuJoCo finds no OpenGL library to render with ({gl_setting()})"
    raise NoOpenGL(reason) from _failures[0]
