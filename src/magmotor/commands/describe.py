"""Say what of a model is magnetic, and what has a temperature."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from magmotor.commands.model_file import answer, read
from magmotor.mjcf.describe import describe


@dataclass
class Options:
    """Options of the command."""

    model: tyro.conf.Positional[Path]
    """MJCF file"""


def main() -> None:
    """Print the description."""
    options = tyro.cli(Options, description=__doc__)
    answer(lambda: print_description(options.model))


def print_description(path: Path) -> None:
    """Print the description of a file."""
    describe(read(path)[0])
