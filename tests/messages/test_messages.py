"""A mistake is answered in the words of its table; `python tests/messages/tables.py` fills them."""

import pytest
import tables

SECTIONS = [(table, section) for table in tables.TABLES for section in tables.sections(table)]


@pytest.mark.parametrize(("table", "section"), SECTIONS, ids=[f"{t} {s}" for t, s in SECTIONS])
def test_a_mistake_is_answered_in_these_words(table, section):
    wrong = [
        f">>> {example.source}{found or 'nothing'}"
        for example, found in tables.run(table, section)
        if not tables.agree(example.words, found)
    ]
    assert not wrong, "\n".join(wrong)
