"""Print the path of the library of compiled functions."""

import os
from dataclasses import dataclass

from magmotor.commands.output import MISTAKE, fail
from magmotor.commands.parsing import parse_options
from magmotor.common.exceptions import ArgumentError


@dataclass
class Options:
    """Options of the command."""


def main() -> None:
    """Print the path, or say that there is no library."""
    parse_options(Options, __doc__)
    from magmotor.numerics.native_library import FOLDER, SWITCH, library

    try:
        found = library()
    except ArgumentError as error:
        fail(str(error), MISTAKE)
    if found is None:
        if os.environ.get(SWITCH) == "0":
            fail(f"{SWITCH}=0 turns the library off", 1)
        remedy = "in a clone, `make library` builds one; else install a wheel for this platform"
        fail(f"{FOLDER} has no library that this processor and magmotor can use: {remedy}", 1)
    print(found.path)
