"""Values of a wrong type are rejected in one line that names the expected classes."""

from typing import Any

import mujoco
import pytest

import magmotor as mm


@pytest.mark.parametrize("wrong", [None, "model.xml", 3])
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (mm.Langevin, "model = .*: must be an instance of mujoco.MjModel"),
        (mm.Langevin(mm.build(mm.Disk())).step, "data = .*: must be an instance of mujoco.MjData"),
        (mm.scene_of, "run = .*: must be an instance of xarray.Dataset"),
        (mm.rerun, "run = .*: must be an instance of xarray.Dataset"),
        (
            mm.methods,
            "scene = .*: must be an instance of magmotor.Disk, magmotor.LangevinParticle, ",
        ),
    ],
)
def test_a_wrong_type_is_rejected(call, message, wrong):
    with pytest.raises(ValueError, match=f"^{message}"):
        call(wrong)


def test_a_message_shows_a_plain_number():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint name='x' type='slide' axis='1 0 0'/>"
        "<joint name='skew' type='slide' axis='1 1 0'/><geom size='1' mass='2'/></body></worldbody>"
        "</mujoco>"
    )
    with pytest.raises(ValueError, match=r"inertia between .* = 1\.41\d*: must be zero"):
        mm.Langevin(model)


def test_a_scene_for_a_model_and_a_model_for_a_scene_are_told_where_to_go():
    scene: Any = mm.Top()
    model: Any = mm.build(scene)
    with pytest.raises(ValueError, match=r"MjModel, such as magmotor\.build\(scene\)$"):
        mm.check(scene)
    with pytest.raises(ValueError, match=r"by mujoco\.mj_step or magmotor\.Langevin$"):
        mm.simulate(model, method="mujoco/euler", timestep=1e-3, duration=1.0)
