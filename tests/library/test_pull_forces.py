"""Pull of magnets on steel and on each other, in the table of the docs; see `benchmarks/accuracy`.

Closed forms judge magnets on thick steel and pairs; finite elements judge sheets and a pot.
"""

from pathlib import Path

import pytest

from benchmarks.accuracy.pull import CASES, pull, row

PAGE = Path(__file__).parents[2] / "docs" / "pull_forces.md"
WRONG = "iron meets iron"
"""What the model does not compute; the table says how wrong it is."""


def cells(case):
    """The cells of a case in the docs' table."""
    line = PAGE.read_text(encoding="utf-8").split("| magnet |")[1].splitlines()[2:]
    return [cell.strip() for cell in line[CASES.index(case)][1:-1].split("|")]


def cases(by_elements):
    chosen = [case for case in CASES if bool(case.elements) == by_elements]
    return pytest.mark.parametrize("case", chosen, ids=lambda case: ", ".join(case.names()))


@cases(by_elements=False)
def test_pull_on_thick_steel_and_of_pairs(case):
    assert pull(case) == pytest.approx(case.right, rel=0.003)  # 0.0011
    assert cells(case) == row(case)


@cases(by_elements=True)
def test_pull_on_sheets_and_of_a_pot(case):
    if case.why != WRONG:
        rel = 0.15 if case.why == "saturation" else 0.06  # 0.098, 0.039
        assert pull(case) == pytest.approx(case.right, rel=rel)
    assert cells(case) == row(case)
