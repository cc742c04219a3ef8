"""Every program answers --help with a paragraph and nothing else, and rejects unknown flags."""

import os
import runpy
import sys
import warnings
from pathlib import Path

import pytest

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
FOLDERS = {
    "benchmarks": "",
    "examples": "",
    "scripts": "",
    "tests": "argparse",
    "trials": "argparse",
}
"""Folders of programs, and the text that distinguishes those for users from helpers."""

PROGRAMS = [
    path.relative_to(ROOT).as_posix()
    for folder, marker in FOLDERS.items()
    for path in sorted((ROOT / folder).rglob("*.py"))
    for text in [path.read_text(encoding="utf-8")]
    if '\nif __name__ == "__main__":\n' in text and marker in text
]


@pytest.fixture
def run(monkeypatch, capsys, without_rotor):
    """Return a function that runs a program here and returns exit code, stdout and stderr."""
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # scripts set it
    before = dict(os.environ)  # some choose how many threads there are

    def run(program, *arguments):
        path = ROOT / program
        package = path.name == "__main__.py"
        monkeypatch.syspath_prepend(path.parents[1] if package else path.parent)
        monkeypatch.setattr(sys, "argv", [path.name, *arguments])
        monkeypatch.delitem(sys.modules, f"{path.parent.name}.__main__", raising=False)
        execute = runpy.run_module if package else runpy.run_path
        with pytest.raises(SystemExit) as stop:
            execute(path.parent.name if package else str(path), run_name="__main__")
        return stop.value.code or 0, *capsys.readouterr()

    yield run
    os.environ.clear()
    os.environ.update(before)


def test_the_programs_are_found():
    found = {Path(program).name for program in PROGRAMS}
    some = {"run.py", "charts.py", "sweep.py", "compass_needles.py", "bits.py", "__main__.py"}
    assert some < found


@pytest.mark.parametrize("program", PROGRAMS)
def test_help_is_a_paragraph(run, program):
    code, said, errors = run(program, "--help")
    assert (code, errors) == (0, "")
    assert said.startswith("usage: ")
    paragraph = said.split("\n\n")[1]
    assert len(paragraph) > 40
    assert not paragraph.startswith(("options:", "positional arguments:", "╭"))
    assert "--help" in said


@pytest.mark.parametrize("program", PROGRAMS)
def test_an_unknown_flag_is_refused(run, program):
    code, said, errors = run(program, "--no-such-flag")
    assert (code, said) == (2, "")
    assert errors


@pytest.mark.parametrize(
    ("program", "topics"),
    [("run.py", ("rigid", "fast")), ("charts.py", ("--only", "detail", "fast"))],
)
def test_an_unknown_topic_is_named_in_one_line(run, program, topics):
    code, said, errors = run(f"benchmarks/{program}", *topics)
    assert (code, said, errors.count("\n")) == (2, "", 1)
    assert errors.startswith(f"{program}: ")
    assert "'fast'" in errors
