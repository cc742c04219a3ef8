"""Cameras: pictures of a model by one of its cameras, in which only what moves is rendered anew."""

import warnings

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.environment import gl_setting
from magmotor.common.exceptions import MagmotorError
from magmotor.mjcf.lookup import number_of
from magmotor.render.region import Region
from magmotor.render.trail import Trail

Image = NDArray[np.uint8]

MOST_GEOMS = 10_000
"""Largest number of geoms in a picture, as in `mujoco.Renderer`."""

MOST_BACKGROUNDS = 40
"""Number of backgrounds to keep: one for each tile of a contact sheet."""


class NoOpenGL(MagmotorError, RuntimeError):
    """No OpenGL library is available, or not the one that MUJOCO_GL names."""


class Camera:
    """Pictures by one camera, of a model that looks the same in all of them but for its pose.

    If the camera rests, it renders what rests, the background, only once.

    Parameters
    ----------
    model : mujoco.MjModel
        Its offscreen buffer has the size of the pictures.
    name : str
    height, width : int
        In pixels.
    """

    def __init__(self, model: mujoco.MjModel, name: str, height: int, width: int):
        self.model, self.number = model, number_of(model, "camera", name)
        self.camera = mujoco.MjvCamera()
        self.camera.type, self.camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, self.number
        self.whole = Region(0, 0, width, height)
        self.opengl = mujoco.GLContext(width, height)
        self.opengl.make_current()
        try:
            self.context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150)
        except mujoco.FatalError:
            self.opengl.free()
            raise
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self.context)
        self.scene = mujoco.MjvScene(model, MOST_GEOMS)
        self.scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = False  # no camera sees it
        # The ring's shadow would look like a second ring, and costs more than all the rest.
        self.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
        self.moves = _moving_bodies(model)[model.geom_bodyid]
        self.has_background = _has_background(model, self.number)
        self.backgrounds: dict[bytes, Image] = {}
        self.seen: set[int] = set()

    def draw(self, data: mujoco.MjData, trail: Trail | None, until: float) -> Image:
        """Render a pose, with the trail up to a time (s); shape (height, width, 3)."""
        self.opengl.make_current()
        background = self._background(data) if self.has_background else None
        self._update(data)
        centers, radii = data.geom_xpos[self.moves], self.model.geom_rbound[self.moves]
        if trail is not None:
            strips = trail.add_to(self.scene, until)
            centers = np.concatenate([centers, strips])
            radii = np.concatenate([radii, np.full(len(strips), trail.radius)])
        if background is None:
            return self._render(self.whole)
        camera = mujoco.mjv_averageCamera(*self.scene.camera)  # of two eyes
        region = self.whole.around(centers, radii, camera)
        picture = background.copy()
        if region.width and region.height:
            picture[region.rows_and_columns(self.whole.height)] = self._render(region)
        return picture

    def close(self) -> None:
        """Free the OpenGL context."""
        self.opengl.make_current()
        self.context.free()
        self.opengl.free()

    def _background(self, data: mujoco.MjData) -> Image | None:
        """Return a picture of what rests, which depends on the scene, and on its script.

        Except for the first one, it is made when it is needed again; until then, return None.
        """
        rests, number = ~self.moves, self.number
        poses = (
            *(data.geom_xpos[rests], data.geom_xmat[rests]),
            *(data.cam_xpos[number], data.cam_xmat[number], data.light_xpos, data.light_xdir),
        )
        key = b"".join(pose.tobytes() for pose in poses)
        if key in self.backgrounds:
            self.backgrounds[key] = self.backgrounds.pop(key)  # the last one to be discarded
        elif self.backgrounds and hash(key) not in self.seen:
            self.seen.add(hash(key))
            return None
        else:
            if len(self.backgrounds) == MOST_BACKGROUNDS:
                del self.backgrounds[next(iter(self.backgrounds))]
            self._update(data)
            for geom in self.scene.geoms[: self.scene.ngeom]:
                if self.moves[geom.objid]:
                    geom.rgba[3] = 0
            self.backgrounds[key] = self._render(self.whole)
        return self.backgrounds[key]

    def _update(self, data: mujoco.MjData) -> None:
        option, mark, shown = mujoco.MjvOption(), mujoco.MjvPerturb(), mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self.model, data, option, mark, self.camera, shown, self.scene)

    def _render(self, region: Region) -> Image:
        for camera in self.scene.camera:
            self.whole.narrow(camera, region)
        picture = np.empty((region.height, region.width, 3), np.uint8)
        rectangle = mujoco.MjrRect(0, 0, region.width, region.height)
        mujoco.mjr_render(rectangle, self.scene, self.context)
        mujoco.mjr_readPixels(picture, None, rectangle, self.context)
        return picture[::-1]


def _has_background(model: mujoco.MjModel, camera: int) -> bool:
    """Whether a camera rests, and what moves changes the picture only where it is."""
    moves, fixed = _moving_bodies(model), mujoco.mjtCamLight.mjCAMLIGHT_FIXED
    return bool(
        model.cam_mode[camera] == fixed
        and model.cam_projection[camera] == mujoco.mjtProjection.mjPROJ_PERSPECTIVE
        and not moves[model.cam_bodyid[camera]]
        and (model.light_mode == fixed).all()
        and not moves[model.light_bodyid].any()
        and not model.mat_reflectance.any()
        and (model.site_group >= mujoco.mjNGROUP // 2).all()  # hidden
        and model.ntendon + model.nskin + model.nflex == 0
    )


def _moving_bodies(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Return which bodies have joints, or an ancestor with joints; shape (bodies,)."""
    moves = model.body_dofnum > 0
    for body, parent in enumerate(model.body_parentid):
        moves[body] |= moves[parent]
    return moves


_failures: list[Exception] = []
"""The first failure to open OpenGL, kept since a second try with GLFW would abort the process."""


def open_camera(model: mujoco.MjModel, name: str, height: int, width: int) -> Camera:
    """Open one of a model's cameras; see `Camera`. NoOpenGL is raised if there is no OpenGL."""
    if not _failures:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # GLFW also warns of the error
                return Camera(model, name, height, width)
        except (AttributeError, ImportError, RuntimeError, mujoco.FatalError) as error:
            # AttributeError: MUJOCO_GL=disable. ImportError: EGL without a display. RuntimeError:
            # OSMesa without a context. FatalError: GLFW without a window system.
            _failures.append(error.with_traceback(None))  # which would keep the context
    reason = f"MuJoCo finds no OpenGL library to render with ({gl_setting()})"
    raise NoOpenGL(reason) from _failures[0]
