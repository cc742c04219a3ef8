"""Scenes as MuJoCo models and as standalone MJCF."""

from copy import copy
from functools import lru_cache

import mujoco

from magmotor.arguments import checked
from magmotor.checks import reject
from magmotor.engines.mujoco import parts
from magmotor.engines.mujoco.compose_disk import compose_disk
from magmotor.engines.mujoco.compose_motor import compose_motor
from magmotor.engines.mujoco.compose_top import compose_top
from magmotor.scenes import Disk, Motor, Top

COMPOSERS = {Top: compose_top, Motor: compose_motor, Disk: compose_disk}


def compose(scene: Top | Motor | Disk, *, looks: bool) -> parts.Element:
    """The scene as a PyMJCF tree, with lights, cameras and decoration if `looks`.

    Raises
    ------
    ValueError
        There is no such scene in MuJoCo.
    """
    _check(scene)
    return COMPOSERS[type(scene)](scene, looks=looks)


@checked
def build(scene: Top | Motor | Disk, *, looks: bool = False) -> mujoco.MjModel:
    """Compile a scene.

    Parameters
    ----------
    scene : Top, Motor or Disk
        What to build. Dipoles, noise and potential act on the model inside `magnetism()`.
    looks : bool
        Add lights, cameras, materials and decoration, which cost time in every step and change
        nothing in the dynamics.

    Returns
    -------
    mujoco.MjModel
        Its keyframe 0 is the scene's initial state.

    Raises
    ------
    ValueError
        There is no such scene in MuJoCo.

    Examples
    --------
    >>> import magmotor as mm
    >>> model = mm.build(mm.Disk())
    >>> [model.joint(i).name for i in range(model.njnt)]
    ['x', 'theta']
    """
    _check(scene)
    return copy(_compiled(scene, looks))


@lru_cache(maxsize=8)
def _compiled(scene: Top | Motor | Disk, looks: bool) -> mujoco.MjModel:
    """The model of which each caller has a copy: that takes a hundredth of the time."""
    return parts.compiled(compose(scene, looks=looks))


def _check(scene: Top | Motor | Disk) -> None:
    if type(scene) not in COMPOSERS:
        raise reject("scene", scene, "a scene that MuJoCo has: Top, Motor or Disk")
