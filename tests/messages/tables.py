"""What the package says about mistakes: tables of statements, each above its message.

    python tests/messages/tables.py [TABLE ...]

writes the messages that differ into the tables, or into some of them, for you to read in the diff.

A table is the text TABLE of a module in this folder, in the form of Python's doctest: statements
after >>> and ..., with the module's names, and below them the type and the words of the error or
the warnings. A statement without words is a preparation, and must say nothing. A line that begins
with # starts a section, with names of its own. Words go on in lines that are indented by four
spaces, and three dots stand for any characters.
"""

import doctest
import os
import sys
import tempfile
import textwrap
import warnings
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import magmotor.devices  # magmotor selects an OpenGL library before a table imports MuJoCo
from magmotor.device.device import SCENES

FOLDER = Path(__file__).parent
TABLES = sorted({path.stem for path in FOLDER.glob("*.py")} - {"tables", "test_messages"})
WIDTH = 98


class Example(NamedTuple):
    """A statement of a table, and what it has to say."""

    section: str
    source: str
    words: str
    line: int
    """Number of the statement's first line in its file, from 0."""


def examples(table: str) -> list[Example]:
    """Return the statements of a table, in order."""
    lines = (FOLDER / f"{table}.py").read_text(encoding="utf-8").splitlines()
    (first,) = (number for number, line in enumerate(lines) if line.startswith("TABLE = "))
    found, section, text = [], "", import_module(table).TABLE
    for part in doctest.DocTestParser().parse(text):
        if isinstance(part, doctest.Example):
            found.append(Example(section, part.source, part.want, first + part.lineno))
            continue
        for title in filter(None, part.splitlines()):
            if not title.startswith("# "):
                raise ValueError(f"{table}.py: {title!r}: must be a title, or follow a statement")
            section = title
    if len(found) != text.count("\n>>> "):
        raise ValueError(f"{table}.py: a comment alone must be a title")
    return found


def said(source: str, names: dict[str, Any]) -> str:
    """Run a statement with `names`; return its warnings and its error, a line each."""
    lines = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            exec(compile(source, "table", "exec"), names)
        except Exception as error:
            kind, element = (getattr(error, name, "") for name in ("kind", "element"))
            where = f"({kind}, {element})" if kind else ""
            lines.append(f"{type(error).__name__}{where}: {str(error).rstrip()}\n")
    return "".join([f"{each.category.__name__}: {each.message}\n" for each in caught] + lines)


def agree(words: str, found: str) -> bool:
    """Whether a table's words are those that were found."""
    words = words.replace("\n    ", " ")
    return doctest.OutputChecker().check_output(words, found, doctest.ELLIPSIS)


def run(table: str, section: str) -> list[tuple[Example, str]]:
    """Run a section of a table; return its statements and what each of them said.

    The scenes are the package's own, and those that the section defines.
    """
    names = dict(vars(import_module(table)))
    chosen = [example for example in examples(table) if example.section == section]
    own = {name: kind for name, kind in SCENES.items() if kind.__module__.startswith("magmotor.")}
    with patch.dict(SCENES, own, clear=True):
        return [(example, said(example.source, names)) for example in chosen]


def sections(table: str) -> list[str]:
    """Return the titles of the sections of a table."""
    return list(dict.fromkeys(example.section for example in examples(table)))


def written(words: str) -> list[str]:
    """Return words as lines of a table."""
    wrapper = textwrap.TextWrapper(
        WIDTH, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
    )
    return [line for sentence in words.splitlines() for line in wrapper.wrap(sentence)]


def main() -> None:
    """Run the program."""
    sys.path[:0] = map(str, (FOLDER, FOLDER.parent, FOLDER.parents[1]))
    os.chdir(tempfile.mkdtemp())  # should something be written that ought to be refused
    for table in sys.argv[1:] or TABLES:
        path = FOLDER / f"{table}.py"
        lines = path.read_text(encoding="utf-8").splitlines()
        results = [result for section in sections(table) for result in run(table, section)]
        changed = [result for result in results if not agree(result[0].words, result[1])]
        for example, found in reversed(changed):
            begin = example.line + example.source.count("\n")
            lines[begin : begin + example.words.count("\n")] = written(found)
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        print(f"{table}: {len(results)} statements, {len(changed)} of them say something else now")


if __name__ == "__main__":
    main()
