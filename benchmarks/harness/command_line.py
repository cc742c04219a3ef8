"""Command-line parser of the benchmark programs."""

import argparse
from typing import NoReturn


class Parser(argparse.ArgumentParser):
    """A parser that reports an error in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")
