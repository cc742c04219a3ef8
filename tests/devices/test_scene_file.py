"""A scene survives its file to the bit, and what is wrong with a file is said in one sentence."""

import dataclasses
import time
import tomllib

import numpy as np
import pytest
import xarray as xr
from refusals import refused

import magmotor as mm
from magmotor.commands.scene_options import PRESETS
from magmotor.device import Scene, provenance
from magmotor.device.device import SCENES
from magmotor.device.quantities import is_quantity
from magmotor.run.scene_file import toml_of

EXAMPLES = {
    **{f"{kind} {name}": scene for kind, p in PRESETS.items() for name, scene in p.scenes.items()},
    "disk": mm.Disk(),
    "particle": mm.LangevinParticle(noise=0.1 + 0.2),
    "flat": mm.Disk(potential=()),
    "pairs": mm.Disk(potential=((1 / 3, 0.0), (5e-30, -0.0))),
    "desk": mm.Motor.desk(),
    "small": mm.Top(coupling=1e-30, ball_inertia=2e-5, ring_dipoles=7, surface="plane"),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_scene_survives_its_file(tmp_path, name):
    scene, path = EXAMPLES[name], tmp_path / "scene.toml"
    mm.write_scene(scene, path)
    read = mm.read_scene(path)
    assert read == scene
    assert provenance.attributes_of(read) == provenance.attributes_of(scene)


def test_the_examples_have_every_kind_of_field():
    kinds = {type(v) for s in EXAMPLES.values() for v in dataclasses.asdict(s).values()}
    assert kinds == {float, int, str, tuple, type(None)}


def test_a_dataset_gives_its_scene(tmp_path):
    scene = mm.Top.experiment(tilt=0.1)
    path = tmp_path / "scene.toml"
    mm.write_scene(mm.scene_of(xr.Dataset(attrs=provenance.attributes_of(scene))), path)
    assert mm.read_scene(path) == scene


def test_a_scene_is_written_as_toml_only(tmp_path):
    with refused("path"):
        mm.write_scene(mm.Top(), tmp_path / "x.json")
    assert not [*tmp_path.iterdir()]


def test_each_field_is_listed_with_its_unit():
    scene = mm.Top()
    text = toml_of(scene)
    assert tomllib.loads(text)["scene"] == "Top"
    for field in filter(is_quantity, dataclasses.fields(scene)):
        (line,) = [x for x in text.splitlines() if x.removeprefix("# ").startswith(f"{field.name} ")
                   or x.startswith(f"# {field.name}:")]  # fmt: skip
        unit = field.metadata["unit"]
        assert unit in ("", "1") or unit in line
        assert field.metadata["doc"] in line


def test_fields_that_are_left_out_have_their_defaults(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text('scene = "Motor"\ntemperature = "nonuniform"\ninner_mass = 7\n')
    assert mm.read_scene(path) == mm.Motor(temperature="nonuniform", inner_mass=7.0)


def test_a_byte_order_mark_is_no_part_of_a_scene(tmp_path):
    path = tmp_path / "my.toml"
    path.write_bytes(b"\xef\xbb\xbf" + b'scene = "Top"\r\ntilt = 0.1\r\n')
    assert mm.read_scene(path) == mm.Top(tilt=0.1)


@pytest.mark.parametrize("text", ['scene = "Top"\nfriction = ', "a = [\n[\n", "[a\nb]\n"])
def test_what_is_wrong_with_a_file_is_said_in_one_line(tmp_path, text):
    path = tmp_path / "my.toml"
    path.write_text(text)
    with pytest.raises(mm.InputError) as caught:
        mm.read_scene(path)
    assert str(caught.value).startswith(f"{path}: it is not TOML: ")
    assert "\n" not in str(caught.value)


def test_a_comment_and_a_text_may_have_many_dots(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text('# see www.a.b.c.d.example.org\nscene = "Top"  # 1.2.3.4.5.6.7\ntilt = 0.1\n')
    assert mm.read_scene(path) == mm.Top(tilt=0.1)


def test_a_file_of_empty_lines_is_read_at_once(tmp_path):
    """Without limits on what a key spans, it took 38 s."""
    path = tmp_path / "my.toml"
    path.write_text('scene = "Top"' + 49_000 * "\n")
    began = time.process_time()
    assert mm.read_scene(path) == mm.Top()
    assert time.process_time() - began < 0.6  # 0.02


@dataclasses.dataclass(frozen=True, kw_only=True)
class Odd(Scene):
    """A scene with fields of other types."""

    named: str = 'a "quoted" \\ tab\t del\x7f é'
    switch: bool = True
    made_by: object = None


@pytest.fixture
def odd(monkeypatch):
    monkeypatch.setitem(SCENES, "Odd", Odd)


@pytest.mark.usefixtures("odd")
def test_text_and_switches_survive_but_functions_and_arrays_are_refused(tmp_path):
    path = tmp_path / "odd.toml"
    mm.write_scene(Odd(switch=False), path)
    assert mm.read_scene(path) == Odd(switch=False)
    for value in (len, np.zeros(2), {1: 2}, object()):
        with refused("made_by"):
            mm.write_scene(Odd(made_by=value), tmp_path / "none.toml")
        with refused("made_by"):
            provenance.attributes_of(Odd(made_by=value))
    assert [*tmp_path.iterdir()] == [path]
