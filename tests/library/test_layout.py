"""Struct offsets: right ones are accepted, wrong ones are named."""

import pytest

from magmotor.mjcf import layout


def test_offsets_of_the_running_version_are_verified():
    layout.verify(layout.current())


@pytest.mark.parametrize("name", layout.Layout._fields)
def test_a_field_that_moved_is_named(name):
    moved = layout.current()._replace(**{name: getattr(layout.current(), name) + 24})
    with pytest.raises(layout.LayoutError, match=rf"does not keep .*\b{name}\b"):
        layout.verify(moved)


def test_a_field_that_is_not_declared_is_named(monkeypatch):
    monkeypatch.setattr(layout, "DATA_FIELDS", (*layout.DATA_FIELDS, "no_such_field"))
    layout.current.cache_clear()
    with pytest.raises(layout.LayoutError, match="no_such_field"):
        layout.current()
    monkeypatch.undo()
    layout.current.cache_clear()
    layout.current()
