"""Each class says of every field what it is, in what unit, and what it is by default."""

import dataclasses
import inspect
import re

import pytest

import magmotor as mm
from magmotor.device import Scene, check_fields, quantity
from magmotor.device.quantities import add_parameters, field_descriptions

SCENES = (mm.Top, mm.Motor, mm.Disk, mm.LangevinParticle)


def documented(owner) -> dict[str, str]:
    """Return the entries of the section Parameters of a docstring by name, as one line each."""
    section = re.search(
        r"\nParameters\n-{10}\n(.*?)(\n\n|\Z)", inspect.getdoc(owner) or "", re.DOTALL
    )
    assert section is not None
    entries = re.findall(r"^(\w+) : (.*(?:\n    .*)*)", section[1], re.MULTILINE)
    return {name: re.sub(r"\n +", " ", entry) for name, entry in entries}


@pytest.mark.parametrize("scene", SCENES)
def test_help_describes_each_field(scene):
    found = documented(scene)
    assert [*found] == [field.name for field in dataclasses.fields(scene)]
    for field in dataclasses.fields(scene):
        assert field.metadata["doc"] in found[field.name]
        unit = field.metadata.get("unit", "")
        assert f", in {unit}," in found[field.name] or unit in ("", "1")
    assert max(map(len, str(inspect.getdoc(scene)).splitlines())) <= 100  # 99
    assert "Raises\n------\nValueError" in str(inspect.getdoc(scene))


def test_an_entry_has_type_unit_default_and_bounds():
    found = documented(mm.Top)
    assert found["tilt"] == (
        "float, in rad, default 0.0490874 angle of the ring's normal from the vertical; at least 0"
        " and less than 1.5708"
    )
    assert found["ball_inertia"].startswith("float, in kg m^2, optional moment of inertia")
    assert found["surface"].startswith("{'planar', 'plane'}, default 'planar' planar: constrained")
    assert found["ring_script"].startswith("tuple[Waypoint, ...], default () waypoints (time in s")
    assert found["ring_dipoles"].startswith("int, default 20 number of dipoles")


def test_a_scene_of_ones_own_is_described_too():
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Pendulum(Scene):
        """A pendulum."""

        length: float = quantity(1.0, "m", "length of the rod", above=0)
        name: str = "pendulum"

        def __post_init__(self) -> None:
            check_fields(self)

    add_parameters(Pendulum)
    assert Pendulum.__doc__ == (
        "A pendulum.\n\nParameters\n----------\nlength : float, in m, default 1\n"
        "    length of the rod; greater than 0\nname : str, default 'pendulum'"
    )
    assert [field.unit for field in field_descriptions(Pendulum)] == ["m", ""]


@pytest.mark.parametrize("owner", [mm.Waypoint, mm.Magnet, mm.sweep.Sweep, mm.noise.BrownianPath])
def test_other_classes_describe_their_arguments(owner):
    given = inspect.signature(owner).parameters
    found = " ".join(str(inspect.getdoc(owner)).split("Parameters\n", 1)[1].split())
    for name in given:
        assert name in found
