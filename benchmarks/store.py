"""Records of measurements on disk: a line of JSON each, so that a stopped program can go on."""

import json
import os
import platform
import zlib
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from inspect import getsourcefile
from pathlib import Path

from case import Case, Record

from magmotor.common.versions import package_checksum


def machine() -> str:
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def versions() -> dict[str, str]:
    """Versions of what the measurements are of."""
    found = {name: version(name) for name in ("magmotor", "mujoco", "numba", "numpy", "scipy")}
    return {"python": platform.python_version(), **found}


class Store:
    """The records in a file, by their cases' keys.

    Those are known that were made on this machine, by these versions and this code: magmotor's and
    that of the module which holds the case's function.

    Parameters
    ----------
    path : Path
        Made, with its folder, when the first record is kept.
    """

    def __init__(self, path: Path):
        self.path = path
        self._checksum = cache(_checksum)  # a file that is edited meanwhile is not what runs
        self._maker = {"machine": machine(), **versions(), "code": package_checksum()}
        self._lines = self._read()

    def find(self, case: Case) -> Record | None:
        """Return the record of a case, if there is one."""
        line = self._lines.get(case.key)
        if line is None or line["maker"] != self._maker_of(case):
            return None
        return line["record"]

    def keep(self, case: Case, record: Record) -> None:
        """Append the record of a case; it is on the disk when this returns."""
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
        """Return the last line of each key; a torn last line is cut off for good."""
        if not self.path.exists():
            return {}
        text = self.path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        if whole != text:
            os.truncate(self.path, len(whole))
        lines = [json.loads(line) for line in whole.splitlines()]
        return {line["key"]: line for line in lines}


def _source(run: Callable[[], Record]) -> Path:
    function = getattr(run, "func", run)  # what a partial calls
    found = getsourcefile(function)
    assert found, "the functions of cases are written in Python"
    return Path(found)


def _checksum(files: tuple[Path, ...]) -> int:
    return zlib.crc32(b"".join(file.read_bytes() for file in files))
