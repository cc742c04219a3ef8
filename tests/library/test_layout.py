"""Struct offsets: right ones are accepted, wrong ones are named."""

import ctypes
import json
import re
import tomllib
from pathlib import Path

import mujoco
import pytest

from library import layouts
from magmotor.mjcf import layout


def test_offsets_of_the_running_version_are_verified():
    layout.verify(layout.current())


def test_the_library_knows_the_running_version():
    """Else, or after a field was added: python -m library.layouts VERSION ..."""
    assert json.loads(layouts.PATH.read_text(encoding="utf-8"))["fields"] == [
        *layout.Layout._fields
    ]
    assert layouts.known()[mujoco.mj_versionString()] == layouts.running()


def test_the_oldest_version_that_messages_name_is_the_one_required():
    root = Path(__file__).parents[2]
    (oldest,) = re.findall(r"([\d.]+) to [\d.]+ are", layout.UNSUPPORTED)
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    requirements = project["tool"]["hatch"]["metadata"]["hooks"]["custom"]["dependencies"]
    assert f"mujoco>={oldest}" in requirements


@pytest.mark.parametrize("name", layout.Layout._fields)
def test_a_field_that_moved_is_named(name):
    moved = layout.current()._replace(**{name: getattr(layout.current(), name) + 24})
    with pytest.raises(layout.LayoutError, match=rf"\b{name}\b"):
        layout.verify(moved)


def test_notes_leave_the_iterations_that_mujoco_makes_by_default():
    """The first 100 of each island: nothing that is written to the notes is read there."""
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    data = mujoco.MjData(model)
    islands, each = mujoco.mjNISLAND, mujoco.mjNSOLVER
    assert model.opt.iterations == 100
    ctypes.memset(data._address + layout.current().notes, 255, 8 * layout.NOTES)
    written = [statistic.nupdate != 0 for statistic in data.solver]
    assert written == [False] * (islands * each - 100) + [True] * 100


def test_a_field_that_is_not_declared_is_named(monkeypatch):
    monkeypatch.setattr(layout, "DATA_FIELDS", (*layout.DATA_FIELDS, "no_such_field"))
    layout.current.cache_clear()
    with pytest.raises(layout.LayoutError, match="declare no_such_field"):
        layout.current()
    monkeypatch.undo()
    layout.current.cache_clear()
    layout.current()
