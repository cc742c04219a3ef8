"""Find what will fail in a model with magnets, and which settings work.

The exit code is 1 if there are findings.
"""

from dataclasses import dataclass
from pathlib import Path

import tyro

from magmotor.commands.model_file import answer, ignore_idle, read
from magmotor.commands.parsing import parse_options
from magmotor.mjcf.checking.check import check
from magmotor.mjcf.describe import described

FOUND = 1
"""Exit code if there are findings."""


@dataclass
class Options:
    """Options of the command."""

    model: tyro.conf.Positional[Path]
    """MJCF file"""
    keyframe: str = ""
    """name of the keyframe to check; by default the model's initial state"""


def main() -> None:
    """Print the findings."""
    options = parse_options(Options, __doc__)
    ignore_idle()
    answer(lambda: report(options))


def report(options: Options) -> None:
    """Print the findings; the exit code is 1 if there are some."""
    model, data = read(options.model, options.keyframe)
    found, description = check(model, data), described(model)
    if description.acting and description.marked and not description.plugin:
        print(
            "note: without the plugin magmotor.forces, this acts inside magmotor.magnetism() only"
        )
    if found.findings:
        raise SystemExit(FOUND)
    if not description.acting:
        print("note: nothing acts on this model: it has no dipoles, fields, coils or iron")
