"""Print the path of the library of compiled functions."""

from dataclasses import dataclass

from magmotor.commands.output import fail
from magmotor.commands.parsing import parse_options


@dataclass
class Options:
    """Options of the command."""


def main() -> None:
    """Print the path, or say that there is no library."""
    parse_options(Options, __doc__)
    from magmotor.numerics.native_library import FOLDER, library

    found = library()
    if found is None:
        sentence = (
            "there is no library for this processor here; in a clone, `make library` builds one"
        )
        fail(f"{sentence} in {FOLDER}", 1)
    print(found.path)
