"""A mistake is answered in the words of its table; `python tests/messages/tables.py` fills them."""

import pytest
import scenes
import tables

SECTIONS = [(table, section) for table in tables.TABLES for section in tables.sections(table)]


@pytest.mark.parametrize(("table", "section"), SECTIONS, ids=[f"{t} {s}" for t, s in SECTIONS])
def test_a_mistake_is_answered_in_these_words(table, section, tmp_path, monkeypatch):
    """Also, nothing is written."""
    monkeypatch.chdir(tmp_path)
    wrong = [
        f">>> {example.source}{found or 'nothing'}"
        for example, found in tables.run(table, section)
        if not tables.agree(example.words, found)
    ]
    assert not wrong, "\n".join(wrong)
    assert {path.name for path in tmp_path.iterdir()} <= {"MUJOCO_LOG.TXT"}  # of MuJoCo's warnings


def test_words_that_differ_are_noticed():
    said = "ArgumentError: x = 1: must be 2, ...\n"
    assert tables.agree(said, "ArgumentError: x = 1: must be 2, not 1\n")
    assert tables.agree("ArgumentError: x = 1:\n    must be 2, ...\n", said)
    for other in ("", "x = 1: must be 2, \n", said.replace("be", " be"), said.replace(":", ":\n")):
        assert not tables.agree(said, other)


def test_text_that_is_neither_title_nor_words_is_an_error(monkeypatch):
    lines = "#A", "# A\n>>> 1\n\nValueError: too late", ">>> # 1\nValueError: 1"
    for text in (f"\n{each}\n" for each in lines):
        monkeypatch.setattr(scenes, "TABLE", text)
        with pytest.raises(ValueError, match="must be a title"):
            tables.examples("scenes")
