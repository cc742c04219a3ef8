"""Records of measurements: each case is one record, a line of JSON on disk.

A program that was interrupted resumes with the cases that have no record yet.
"""

import json
import os
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from inspect import getsourcefile
from pathlib import Path
from typing import Any

from tqdm import tqdm

from benchmarks.harness.machine import machine, versions
from magmotor.common.versions import package_checksum

BAR = "{l_bar}{bar}| {elapsed}<{remaining} {postfix}"
NOT_INSTALLED = "not installed: "
"""Begins the reason of a record if other software was missing."""

Record = dict[str, Any]
"""Plain numbers, strings and lists; `failed` is the reason for a missing result."""


@dataclass(frozen=True)
class Case:
    """A measurement: unique key, function that makes the record, approximate duration."""

    key: str
    run: Callable[[], Record]
    seconds: float = 1.0


class Store:
    """Records in a file, by the keys of their cases.

    A record is valid if it was made on this machine, by these versions and this code: that of
    magmotor and that of the module of the case's function.

    Parameters
    ----------
    path : Path
        Created, with its folder, when the first record is kept.
    """

    def __init__(self, path: Path):
        self.path = path
        self._checksum = cache(_checksum)  # the running code does not change if a file is edited
        self._maker = {"machine": machine(), **versions(), "code": package_checksum()}
        self._lines = self._read()

    def find(self, case: Case) -> Record | None:
        """Return the valid record of a case, or None; also None if software was missing then."""
        line = self._lines.get(case.key)
        if line is None or line["maker"] != self._maker_of(case) or not_installed(line["record"]):
            return None
        return line["record"]

    def keep(self, case: Case, record: Record) -> None:
        """Append the record of a case and flush it to the disk."""
        line = {"key": case.key, "maker": self._maker_of(case), "record": record}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line, allow_nan=False) + "\n")
            file.flush()
            os.fsync(file.fileno())
        self._lines[case.key] = line

    def _maker_of(self, case: Case) -> dict[str, str | int]:
        return {**self._maker, "case": self._checksum((_source(case.run),))}

    def _read(self) -> dict[str, dict]:
        """Return the last line of each key; an incomplete last line is removed from the file."""
        if not self.path.exists():
            return {}
        text = self.path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        if whole != text:
            os.truncate(self.path, len(whole))
        lines = [json.loads(line) for line in whole.splitlines()]
        return {line["key"]: line for line in lines}


def not_installed(record: Record) -> str:
    """Return which software was missing for a record; empty if none was."""
    reason = str(record.get("failed", ""))
    return reason.removeprefix(NOT_INSTALLED) if reason.startswith(NOT_INSTALLED) else ""


def measure(cases: Sequence[Case], store: Store) -> dict[str, Record]:
    """Return the records of all cases by key, after measuring those that are missing.

    Raises
    ------
    ValueError
        Two cases have the same key.
    """
    records = {case.key: store.find(case) for case in cases}
    if len(records) < len(cases):
        raise ValueError("two cases have the same key")
    missing = [case for case in cases if records[case.key] is None]
    total = sum(case.seconds for case in missing)
    title = f"{len(missing)} of {len(cases)} cases"
    with tqdm(total=total, bar_format=BAR, desc=title, disable=None) as progress:
        for case in missing:
            progress.set_postfix_str(case.key)
            try:
                records[case.key] = record = case.run()
            except Exception as error:
                error.add_note(f"in the case {case.key}")
                raise
            store.keep(case, record)
            progress.update(case.seconds)
    return {key: record for key, record in records.items() if record is not None}


def _source(run: Callable[[], Record]) -> Path:
    function = getattr(run, "func", run)  # the function of a partial
    found = getsourcefile(function)
    assert found, "the functions of cases are written in Python"
    return Path(found)


def _checksum(files: tuple[Path, ...]) -> int:
    return zlib.crc32(b"".join(file.read_bytes() for file in files))
