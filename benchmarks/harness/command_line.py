"""The command line of the benchmarks' programs."""

import argparse
from typing import NoReturn


class Parser(argparse.ArgumentParser):
    """A parser that names a mistake in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")
