"""Options of the commands, parsed by tyro, whose errors become one line."""

import io
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr
from itertools import takewhile
from typing import TypeVar

import tyro

from magmotor.commands.output import MISTAKE, fail

Options = TypeVar("Options")

RULE = re.compile(r"(?:^|\n)[─-]{5,}(?:\n|$)")
"""What separates the parts of tyro's boxes, once their frames, which need Unicode, are gone."""

KINDS = {"INT": "an integer", "FLOAT": "a number"}
"""What tyro's names of types mean."""


def parse_options(
    options: Callable[..., Options],
    description: str | None,
    arguments: Sequence[str] | None = None,
) -> Options:
    """Parse arguments, by default the program's; a mistake ends it with one line and code 2."""
    arguments = sys.argv[1:] if arguments is None else arguments
    with one_line_errors(arguments):
        return tyro.cli(options, description=description, args=arguments)


@contextmanager
def one_line_errors(arguments: Sequence[str], kinds: Sequence[str] = ()) -> Iterator[None]:
    """End the program with one line where tyro would end it with a box."""
    output = io.StringIO()
    try:
        with redirect_stderr(output):
            yield
    except SystemExit as end:
        if end.code != MISTAKE:
            raise
        scene = [kind for kind in arguments[:1] if kind in kinds]
        program = " ".join([sys.argv[0], *scene])
        fail(sentence(output.getvalue(), [*arguments], program), MISTAKE)


def sentence(box: str, arguments: list[str], program: str) -> str:
    """Return what a box of tyro's says as one sentence, for the arguments that it rejects."""
    _title, *lines = (line.strip("│╰╯ ") for line in box.strip().splitlines())
    parts = (" ".join(part.split()) for part in RULE.split("\n".join(lines)))
    reason, *parts = filter(None, parts)
    rest = " ".join(parts)
    if (flag := re.match(r"Error parsing (-[\w-]+):", reason)) and (
        allowed := re.search(rf"helptext: {flag[1]} (.*?[A-Z}}]) (?=[^A-Z]|[A-Z][a-z])(.*)", rest)
    ):
        values = takewhile(lambda word: not word.startswith("--"), _after(flag[1], arguments))
        kind, meaning = allowed[1].removeprefix("{None}|").strip("{}"), allowed[2]
        meaning = re.sub(r"( \(default: [^)]*\))? For full .*", "", meaning)
        return f"{flag[1]} = {' '.join(values)}: must be {KINDS.get(kind, kind)} ({meaning})"
    if flag := re.match(r"Missing value for argument '(-[\w-]+)'", reason):
        return f"{flag[1]} needs a value; see {program} --help"
    if missing := re.match(r"Missing from .*?: (\S+) (.*?)(?: \(required\))?$", reason):
        return f"{missing[1]} is missing: {missing[2]}; see {program} --help"
    reason = re.sub(r" \(applied to [^)]*\)| Arguments are applied to .*", "", reason)
    meant = re.search(r"Perhaps you meant: (-[\w-]+)", rest)
    hint = f" (did you mean {meant[1]}?)" if meant and meant[1] not in arguments else ""
    return f"{reason[:1].lower()}{reason[1:].rstrip('.')}{hint}; see {program} --help"


def _after(flag: str, arguments: list[str]) -> list[str]:
    """Return the arguments that follow a flag, whose value may be joined to it by `=`."""
    for place, argument in enumerate(arguments):
        name, equals, value = argument.partition("=")
        if name.replace("_", "-") == flag:
            return [value] if equals else arguments[place + 1 :]
    return []
