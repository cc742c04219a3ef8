"""Code in README, site and docstrings runs and prints what they show; what they name exists."""

import doctest
import importlib
import json
import re
import runpy
import shlex
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import ModuleType

import pytest
import yaml

import magmotor as mm
from magmotor.commands import COMMANDS
from magmotor.commands import main as run_command
from magmotor.common.optional import MissingExtra
from magmotor.render import NoOpenGL

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("**/*.md"))]
TEXT = {page: page.read_text(encoding="utf-8") for page in PAGES}
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")

PROGRAMS = [
    path.relative_to(ROOT).as_posix()
    for folder in (
        "src",
        "paper",
        "scripts",
        "examples",
        "benchmarks",
        "library",
        "tests",
        "trials",
    )
    for path in (ROOT / folder).rglob("*.py")
]

PYTHON = re.compile(r"^```python\n(.*?)^```$(?:\n\n```text\n(.*?)^```$)?", re.DOTALL | re.MULTILINE)
"""A block of Python, and the output that may be shown below it."""

FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\((?!https?:)([^)\s#]*)(?:#([^)\s]+))?\)")
WHOLE = {
    "advice.md",
    "tutorial.md",
    "how_it_works.md",
    "bodies_that_spin.md",
    "contact.md",
    "data.md",
    "desk_motor.md",
    "adhesion_weld_or_dipole.md",
    "recipes.md",
    "fields_coils_iron.md",
    "units.md",
    "warp.md",
}
"""Pages whose blocks all run; test_readme.py and test_examples.py cover the others."""

MODULES = [
    ".".join(path.relative_to(ROOT / "src").with_suffix("").parts)
    for path in sorted((ROOT / "src").rglob("*.py"))
    if re.search(r">>> (?!.*\+SKIP)", path.read_text(encoding="utf-8"))
]


def named(pages):
    return [pytest.param(page, id=str(page.relative_to(ROOT))) for page in pages]


@pytest.fixture
def cheap(monkeypatch):
    """Compute sweeps by a thread, and draw movies of few, small frames."""
    run, movie = mm.sweep.run, mm.render.movie

    def by_a_thread(*arguments, **options):
        with ThreadPoolExecutor(1) as executor:
            return run(*arguments, **{"executor": executor, "workers": 1} | options)

    def small(*arguments, **options):
        return movie(*arguments, **{"size": (320, 180), "fps": 10} | options)

    monkeypatch.setattr(mm.sweep, "run", by_a_thread)
    monkeypatch.setattr(mm.render, "movie", small)


@pytest.mark.slow
@pytest.mark.usefixtures("cheap")
@pytest.mark.parametrize("page", named([page for page in PAGES if page.name in WHOLE]))
def test_blocks_run_and_print_the_output_shown(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "__main__"}
    for found in PYTHON.finditer(TEXT[page]):
        line = TEXT[page].count("\n", 0, found.start(1))
        try:
            exec(compile("\n" * line + found[1], page, "exec"), namespace)
        except (NoOpenGL, MissingExtra) as reason:
            pytest.skip(str(reason))
        printed = capsys.readouterr().out
        if found[2] is not None:
            assert printed == found[2], f"{page.name}:{line}"


@pytest.mark.parametrize("module", MODULES)
def test_docstring_examples(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    for example in doctest.DocTestFinder().find(importlib.import_module(module), globs={}):
        runner.run(example, out=said.append)
    assert runner.tries > 0
    assert runner.failures == 0, "".join(said)


@pytest.mark.parametrize("page", named(PAGES))
def test_links_and_pictures_point_to_something(page):
    for path, anchor in LINK.findall(FENCED.sub("", TEXT[page])):
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), path
        if anchor:
            assert anchor in anchors(target), f"{path}#{anchor}"


def anchors(page):
    """Return the anchors of a page, explicit or from its headings as on GitHub and the site."""
    given = re.findall(r'id="([\w-]+)"', TEXT[page])
    headings = re.findall(r"^#+ (.*)$", FENCED.sub("", TEXT[page]), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", name.lower()).replace(" ", "-") for name in headings + given}


@pytest.mark.parametrize("page", named(PAGES))
def test_files_that_are_named_exist(page):
    for path in re.findall(
        r"`((?:src|paper|scripts|models|docs|tests|examples)/[\w./]*)", TEXT[page]
    ):
        assert (ROOT / path).exists(), path
    for path in re.findall(r"`([\w/]+\.py)\b", TEXT[page]):
        assert any(f"/{known}".endswith(f"/{path}") for known in PROGRAMS), path


@pytest.mark.parametrize("page", named(PAGES))
def test_tests_that_are_named_exist(page):
    for files, word in re.findall(r"pytest ((?:tests/\S+\.py\s)+)-k (\w+)", TEXT[page]):
        tests = "".join((ROOT / file).read_text(encoding="utf-8") for file in files.split())
        assert re.search(rf"^def test_\w*{word}", tests, re.MULTILINE), f"{files}-k {word}"


def test_the_tests_of_the_list_exist():
    """Those that `make test-quick` leaves out."""
    lines = (ROOT / "tests" / "slow.txt").read_text(encoding="utf-8").splitlines()
    assert lines == sorted({*lines})
    for file, name in (line.split("::") for line in lines):
        assert f"def {name}(" in (ROOT / file).read_text(encoding="utf-8"), name


def commands():
    """Commands with flags of all pages: lines of shell, and what stands in backticks.

    A flag that stands alone is of the program named last.
    """
    for page, text in TEXT.items():
        program = None
        for found in re.finditer(r"^```sh\n(.*?)^```$|`([^`\n]+)`", text, re.DOTALL | re.MULTILINE):
            for line in (found[1] or found[2]).splitlines():
                if re.match(
                    r"make \S|--\w|magmotor [a-z]|"
                    r"(\S*python )?(scripts|examples|benchmarks)/\w+\.py\b|python -m trials",
                    line,
                ):
                    words = program_of(shlex.split(line, comments=True), program)
                    program = words[0] if words else program
                    yield pytest.param(words, id=f"{page.name}: {line}")


def program_of(words, last):
    """A command as program and arguments; none if it is a verb of make that runs none of ours."""
    if words[0] == "make":
        given = dict(word.split("=", 1) for word in words[1:] if "=" in word)
        recipe = [""] * 2
        for verb in (word for word in words[1:] if "=" not in word):
            recipe = re.search(rf"^{verb}:.*\n((?:\t.*\n)*)", MAKEFILE, re.MULTILINE)
            if not recipe:
                return [f"verb {verb} of the Makefile"]
        program = re.search(r"(?:scripts|benchmarks)/\w+\.py|magmotor [a-z]+", recipe[1])
        return [program[0], *shlex.split(given.get("ARGS", ""))] if program else []
    if words[0] == "magmotor":
        if words[1:3] == ["examples", "run"]:
            return [f"examples/{words[3]}.py", *words[4:]]
        return [" ".join(words[:2]), *words[2:]]
    if words[0].startswith("--"):
        return [last, "any", words[0]] if last else []
    if words[1:2] == ["-m"]:
        path = words[2].replace(".", "/")
        return [f"{path}/__main__.py" if (ROOT / path).is_dir() else f"{path}.py", *words[3:]]
    return words[1:] if words[0].endswith("python") else words


@pytest.mark.parametrize("words", [*commands()])
def test_commands_and_their_flags_exist(words, help_of):
    if words:
        assert words[0].removeprefix("magmotor ") in COMMANDS or (ROOT / words[0]).exists()
    for flag in re.findall(r"(?<!\S)--[\w-]+", " ".join(words)):
        assert re.search(rf"{flag}\b", help_of(*words[:2]))


HELP: dict[tuple[str, ...], str] = {}
"""What --help has said of programs and their subcommands."""


@pytest.fixture
def help_of(monkeypatch, capsys):
    """What --help says of a program, or of the subcommand that a word may be; of any, of all."""
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # scripts set it

    def said(*words):
        if words not in HELP:
            HELP[words] = run(*words)
        return HELP[words]

    def run(program, *words):
        path = ROOT / program
        monkeypatch.syspath_prepend(path.parent)
        monkeypatch.setattr(sys, "argv", [*program.split(), *words, "--help"])
        script = partial(runpy.run_path, str(path), run_name="__main__")
        with pytest.raises(SystemExit, check=lambda stop: not stop.code):
            (run_command if program.startswith("magmotor ") else script)()
        return capsys.readouterr().out

    def help_of(program, word):
        whole = said(program)
        choices = re.match(r"usage: .*\{([\w,]+)\}", whole)
        subcommands = choices[1].split(",") if choices else []
        if word == "any":
            return whole + "".join(said(program, name) for name in subcommands)
        return said(program, word) if word in subcommands else whole

    return help_of


def test_api_pages_name_all_that_is_public():
    pages = "".join(text for page, text in TEXT.items() if page.parent.name == "api")
    for name in vars(mm)["__all__"]:
        module = isinstance(getattr(mm, name), ModuleType)
        assert module or re.search(rf"\bmagmotor\.{name}\b", pages), name
    for package in ("device", "observables", "plots", "render", "sweep", "theory"):
        whole = f"::: magmotor.{package}\n" in pages
        # What is named like its module is hidden by it from what makes the pages.
        for name in importlib.import_module(f"magmotor.{package}").__all__:
            hidden = (ROOT / "src" / "magmotor" / package / f"{name}.py").exists()
            assert (whole and not hidden) or re.search(
                rf"\bmagmotor\.{package}\.{name}\b", pages
            ), name


def test_notebook_holds_no_outputs():
    for cell in json.loads((DOCS / "tour.ipynb").read_text(encoding="utf-8"))["cells"]:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


def test_the_citation_is_that_of_the_file_for_programs():
    page = TEXT[DOCS / "citing.md"]
    software = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    (paper,) = software["references"]
    shown = page.replace("{", "").replace("}", "")
    assert f"title   = {software['title']}," in shown
    assert f"version = {software['version']}," in shown
    assert f"license = {software['license']}\n" in shown
    assert f"title         = {paper['title']}," in shown
    names = " and ".join(f"{a['family-names']}, {a['given-names']}" for a in paper["authors"])
    assert f"author        = {names}," in shown
    assert f"year          = {paper['year']}," in shown
    (eprint,) = re.findall(r"eprint *= (.*),", shown)
    assert f"arXiv:{eprint}" == paper["identifiers"][0]["value"]
    assert software["version"] == mm.__version__
