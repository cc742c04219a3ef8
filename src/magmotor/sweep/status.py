"""How far a sweep has come, read from its directory."""

from dataclasses import dataclass, field
from pathlib import Path

from magmotor.sweep.directory import open_directory
from magmotor.sweep.sealed import Damaged


@dataclass
class Status:
    """Numbers of cases, and what went wrong.

    Attributes
    ----------
    cases, done, failed : int
    errors : dict
        The cases that failed, in words, by error.
    damaged : list of str
        What is wrong with files that do not hold what was written to them, each by its name in the
        directory. Their cases count as missing: `run` computes them again.
    """

    cases: int
    done: int = 0
    errors: dict[str, list[str]] = field(default_factory=dict)
    damaged: list[str] = field(default_factory=list)

    @property
    def failed(self) -> int:
        """How many cases have an error."""
        return sum(map(len, self.errors.values()))

    @property
    def missing(self) -> int:
        """How many cases have neither result nor error."""
        return self.cases - self.done - self.failed


def status(directory: str | Path) -> Status:
    """Look which cases of a sweep are done, failed or missing, and which files are damaged.

    Raises
    ------
    ValueError
        There is no sweep, or the file that tells what it is is damaged.
    """
    store = open_directory(directory)
    found = Status(len(store.sweep))
    for index, case in enumerate(store.sweep):
        try:
            if store.result(case) is not None:
                found.done += 1
            elif (error := store.error(case)) is not None:
                found.errors.setdefault(error, []).append(store.sweep.label(index))
        except Damaged as damage:
            found.damaged.append(str(damage))
    return found
