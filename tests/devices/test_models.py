"""The complete scenes of `models/` are those that `build` composes."""

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.common.environment import data_folder

SCENES = {
    "disk": mm.Disk(),
    "top": mm.Top.paper(4),
    "top_plane": mm.Top.paper(4, surface="plane"),
    "motor": mm.Motor(),
    "motor_plane": mm.Motor(surface="plane"),
}


def test_each_file_has_its_scene():
    names = {path.stem for path in data_folder("models").glob("*.xml")}
    assert names == {*SCENES, "levitation"} | {f"{name}_magnetic" for name in SCENES}


@pytest.mark.parametrize("name", SCENES)
def test_a_file_is_the_scene_to_the_bit(name):
    """Every array and every option, also those of what is only drawn."""
    written = mujoco.MjModel.from_xml_path(str(data_folder("models") / f"{name}.xml"))
    built = mm.build(SCENES[name], visual=True)
    assert numbers(written) == numbers(built)


@pytest.mark.parametrize("name", SCENES)
def test_a_file_shows_its_devices(name):
    model = mujoco.MjModel.from_xml_path(str(data_folder("models") / f"{name}.xml"))
    assert model.key("start").id == 0
    assert {model.camera(i).name for i in range(model.ncam)} >= {"front", "top"}
    assert model.nv > 0


@pytest.mark.parametrize("name", SCENES)
def test_a_viewer_starts_in_the_initial_state(name):
    """But for the orientation of a ball joint, which has no reference: only the motor's differs."""
    model = mujoco.MjModel.from_xml_path(str(data_folder("models") / f"{name}_magnetic.xml"))
    start = model.key("start").qpos
    assert not model.key("start").qvel.any()
    compared = slice(2) if name == "motor" else slice(None)
    np.testing.assert_array_equal(model.qpos0[compared], start[compared])


def numbers(model: mujoco.MjModel) -> dict[str, bytes]:
    """All fields of a model, and of the structs in it, as bytes."""
    found = {}
    for owner, prefix in (
        (model, ""),
        (model.opt, "opt."),
        (model.vis, "vis."),
        (model.stat, "stat."),
    ):
        for field in dir(owner):
            value = getattr(owner, field)
            if field.startswith("_") or callable(value) or field in {"opt", "vis", "stat"}:
                continue
            parts = (
                [value]
                if prefix != "vis."
                else [getattr(value, k) for k in dir(value) if k[0] != "_"]
            )
            found[prefix + field] = b"".join(np.asarray(part).tobytes() for part in parts)
    return found
