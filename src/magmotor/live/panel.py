"""A scene's sliders in MuJoCo's viewer: actuators without force, whose controls are read."""

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import reject
from magmotor.device.device import Scene
from magmotor.device.sliders import SMALLEST, Slider
from magmotor.mjcf import parts
from magmotor.run.in_mujoco import build, compose

MOVED = (
    "body_pos",
    "body_quat",
    "body_user",
    "dof_damping",
    "tendon_damping",
    "pair_solreffriction",
)
"""The model arrays that the sliders change."""


class Panel:
    """The sliders of a scene, which the viewer shows in its panel Control as the model's `ctrl`.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    sliders : dict of str to Slider
        By name, in the order of `ctrl`.
    """

    def __init__(self, scene: Scene):
        self.scene = scene
        self.sliders = scene.device.sliders(scene)

    def model(self) -> mujoco.MjModel:
        """Compile the decorated scene with its sliders; keyframe 0 holds their initial values.

        Zero friction or noise is replaced by a tiny value, so that its slider can raise it.

        Raises
        ------
        ValueError
            The scene has no MuJoCo model, or the model has no keyframe, or sliders but no joint.
        """
        start = {name: slider.start for name, slider in self.sliders.items()}
        kept = (
            self.scene.device.scene_at(self.scene, start)
            if SMALLEST in start.values()
            else self.scene
        )
        root = compose(kept, visual=True)
        add = _add_to_spec if isinstance(root, mujoco.MjSpec) else _add_to_tree
        try:
            root = add(root, self.sliders, list(start.values()))
        except IndexError:
            sentence = "its model must have a keyframe, its initial state, and sliders a joint"
            raise reject("scene", self.scene, sentence) from None
        model = parts.compiled(root)
        model.stat.meansize = model.stat.extent / 20  # size of the markers of mouse forces
        return model

    def values(self, ctrl: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sliders' values, clipped to their ranges."""
        least, largest = ([s[k] for s in self.sliders.values()] for k in (1, 2))
        return np.clip(ctrl, least, largest)

    def moved(self, values: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the arrays `MOVED` of the scene with its sliders at these values.

        Raises
        ------
        ValueError
            No scene has these values; names the field, its value and the bound.
        """
        named = dict(zip(self.sliders, map(float, values), strict=True))
        model = build(self.scene.device.scene_at(self.scene, named))
        return {name: getattr(model, name) for name in MOVED}


def _add_to_tree(
    root: parts.Element, sliders: Mapping[str, Slider], start: list[float]
) -> parts.Element:
    """Add the sliders, and their values at the start, to a PyMJCF tree; return it."""
    root.keyframe.key[0].ctrl = start
    for name, slider in sliders.items():
        joint = root.worldbody.find_all("joint")[0]
        ends = [slider.least, slider.largest]
        root.actuator.add("general", name=name, joint=joint, gainprm=[0], ctrlrange=ends)
    return root


def _add_to_spec(
    spec: mujoco.MjSpec, sliders: Mapping[str, Slider], start: list[float]
) -> mujoco.MjSpec:
    """Add the sliders, and their values at the start, to a copy of an MjSpec; return it."""
    spec = spec.copy()
    spec.keys[0].ctrl = start
    for name, slider in sliders.items():
        joint = spec.joints[0]
        joint.name = joint.name or "joint of the sliders"
        spec.add_actuator(
            name=name,
            target=joint.name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            gainprm=[0.0] * mujoco.mjNGAIN,
            ctrlrange=[slider.least, slider.largest],
            ctrllimited=True,
        )
    return spec
