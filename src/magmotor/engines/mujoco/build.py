"""Scenes as MuJoCo models and as standalone MJCF."""

import mujoco

from magmotor.engines.mujoco import parts
from magmotor.engines.mujoco.compose_top import compose_top
from magmotor.scenes import Top

COMPOSERS = {Top: compose_top}


def compose(scene: Top, *, looks: bool) -> parts.Element:
    """The scene as a PyMJCF tree, with lights, cameras and decoration if `looks`."""
    return COMPOSERS[type(scene)](scene, looks=looks)


def build(scene: Top, *, looks: bool = False) -> mujoco.MjModel:
    """Compile a scene.

    Parameters
    ----------
    scene : Top
        What to build. Magnetism acts on the model inside `magnetism()`.
    looks : bool
        Add lights, cameras, materials and decoration, which cost time in every step and change
        nothing in the dynamics.

    Returns
    -------
    mujoco.MjModel
        Its keyframe 0 is the scene's initial state.
    """
    root = compose(scene, looks=looks)
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())
