"""A scene's sliders in a live view: actuators without force, whose controls are read."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import Scene
from magmotor.device.sliders import SMALLEST
from magmotor.mjcf import model_parts
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
    """The sliders of a scene: actuators, which the viewer shows in its panel Control.

    An actuator's name is that of its slider, with the unit, such as `tilt (rad)`.

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
        try:
            spec = self._added_to(model_parts.spec_of(root))
        except IndexError:
            needed = "a keyframe for its initial state, and a joint if it has sliders"
            raise ArgumentError("scene", self.scene, f"its model must have {needed}") from None
        model = model_parts.compiled(spec)
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

    def _added_to(self, spec: mujoco.MjSpec) -> mujoco.MjSpec:
        """Add the sliders to an MjSpec, with their initial values in its keyframe; return it."""
        others = [0.0] * len(spec.actuators)  # whose controls have no effect
        spec.keys[0].ctrl = others + [slider.start for slider in self.sliders.values()]
        for name, slider in self.sliders.items():
            joint = spec.joints[0]
            joint.name = joint.name or "joint of the sliders"
            spec.add_actuator(
                name=slider.label(name),
                target=joint.name,
                trntype=mujoco.mjtTrn.mjTRN_JOINT,
                gainprm=[0.0] * mujoco.mjNGAIN,
                ctrlrange=[slider.least, slider.largest],
                ctrllimited=True,
            )
        return spec
