"""List what in a model is magnetic, and what has a temperature."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from magmotor.commands.model_file import answer, ignore_idle, read
from magmotor.commands.parsing import parse_options
from magmotor.mjcf.describe import describe


@dataclass
class Options:
    """Options of the command."""

    model: tyro.conf.Positional[Path]
    """MJCF file"""


def main() -> None:
    """Print the description."""
    options = parse_options(Options, __doc__)
    ignore_idle()
    answer(lambda: print_description(options.model))


def print_description(path: Path) -> None:
    """Print the description of a file."""
    print(describe(read(path)[0]))
