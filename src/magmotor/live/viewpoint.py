"""Where a live view is seen from."""

import math

import mujoco
import numpy as np

from magmotor.common.arrays import Array


def free_camera(model: mujoco.MjModel) -> mujoco.MjvCamera:
    """Return MuJoCo's default camera, which shows the whole model."""
    camera = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(model, camera)
    return camera


def traveler(model: mujoco.MjModel) -> int | None:
    """Return the body that the camera follows, since it leaves the place; None without one."""
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "disk")
    return None if body < 0 else body


def eye(camera: mujoco.MjvCamera) -> Array:
    """Return the position of a camera in m, from its distance, azimuth and elevation."""
    azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
    level = math.cos(elevation)
    forward = level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)
    return camera.lookat - camera.distance * np.array(forward)
