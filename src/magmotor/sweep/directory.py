"""The directory of a sweep: one file a case, each whole or not there.

`sweep.json` tells what the sweep is; `done/ab/KEY.json` (`.nc` where whole runs are recorded) holds
what was measured in the case of that key, `failed/KEY.json` why another failed. Files are written
in `parts/` and take their names when they are on the disk. `claims/KEY` says who computes a case.
"""

import json
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

from magmotor.checks import reject
from magmotor.sweep.case import Case, canonical
from magmotor.sweep.definition import Sweep, sweep_from
from magmotor.sweep.measures import TRAJECTORY
from magmotor.sweep.work import Outcome
from magmotor.whole_files import is_dead as _is_dead
from magmotor.whole_files import this_driver, write_whole

SWEEP = "sweep.json"


class Directory:
    """A sweep's results on disk.

    Parameters
    ----------
    path : Path
        Made, with its parents, if it is not there.
    sweep : Sweep

    Raises
    ------
    ValueError
        The directory holds another sweep, or other things.
    OSError
        It cannot be written to.
    """

    def __init__(self, path: Path, sweep: Sweep):
        self.path, self.sweep = path, sweep
        self.claims: set[Path] = set()
        self.suffix = ".nc" if sweep.measure == (TRAJECTORY,) else ".json"
        told = canonical(sweep.as_json())
        others = _other_things(path)
        if not (path / SWEEP).exists():  # asked last: another driver may have begun meanwhile
            if others:
                raise reject(
                    "directory", str(path), f"empty, or this sweep's; it holds {others[0]}"
                )
            path.mkdir(parents=True, exist_ok=True)
            self._write(path / SWEEP, told)
        check_same(path, json.loads(told), read(path))

    def found(self, case: Case) -> Path | None:
        """The result file of a case, if it is there."""
        path = self._done(case)
        return path if path.exists() else None

    def error(self, case: Case) -> str | None:
        """Why a case failed, if it did."""
        try:
            return json.loads((self.path / "failed" / f"{case.key}.json").read_bytes())["error"]
        except FileNotFoundError:
            return None

    def claim(self, case: Case) -> bool:
        """Tell other drivers that a case is under way; False if another was first."""
        claim = self.path / "claims" / case.key
        claim.parent.mkdir(exist_ok=True)
        try:
            with claim.open("x") as file:
                self.claims.add(claim)
                file.write(this_driver())
        except FileExistsError:
            return False
        return True

    def take_back_claims(self) -> None:
        """Leave to others what is not done."""
        for claim in self.claims:
            claim.unlink(missing_ok=True)

    def keep(self, case: Case, outcome: Outcome) -> None:
        """Write what came of a case.

        Raises
        ------
        OSError
            It cannot be written; all that was written before is there.
        """
        failed = self.path / "failed" / f"{case.key}.json"
        if outcome.error is None:
            assert outcome.content is not None
            self._write(self._done(case), outcome.content)
            for old in (failed, failed.with_suffix(".nc")):
                old.unlink(missing_ok=True)
        else:
            if outcome.content is not None:
                self._write(failed.with_suffix(".nc"), outcome.content)
            self._write(failed, canonical({"case": case.told, "error": outcome.error}) + b"\n")
        claim = self.path / "claims" / case.key
        claim.unlink(missing_ok=True)
        self.claims.discard(claim)

    def _done(self, case: Case) -> Path:
        return self.path / "done" / case.key[:2] / f"{case.key}{self.suffix}"

    def _write(self, path: Path, content: bytes) -> None:
        # Several threads of a driver may write the same file.
        part = self.path / "parts" / f"{path.name}.{threading.get_ident()}@{this_driver()}"
        for folder in (part.parent, path.parent):
            folder.mkdir(parents=True, exist_ok=True)
        write_whole(path, content, part)

    def remove_what_the_dead_left(self) -> None:
        """Remove half-written files and claims of this machine's drivers that were killed."""
        for part in self.path.glob("parts/*"):
            if _is_dead(part.name.rpartition("@")[2]):
                part.unlink(missing_ok=True)
        for claim in self.path.glob("claims/*"):
            with suppress(FileNotFoundError):
                if _is_dead(claim.read_text()):
                    claim.unlink()


def _other_things(path: Path) -> list[str]:
    """Names in a directory, if it is there, but for what drivers leave that begin a sweep in it."""
    try:
        return sorted(file.name for file in path.iterdir() if not _is_beginning(file))
    except FileNotFoundError:
        return []
    except NotADirectoryError:
        raise reject("directory", str(path), "a directory") from None


def _is_beginning(file: Path) -> bool:
    """Whether it is `parts/` of drivers that write `sweep.json`, or were killed at it."""
    if file.name != "parts" or not file.is_dir():
        return False
    return all(part.name.startswith(f"{SWEEP}.") for part in file.iterdir())


def open_directory(path: str | Path) -> Directory:
    """The directory of a sweep that is there; ValueError if there is none."""
    return Directory(Path(path), sweep_of(path))


def sweep_of(path: str | Path) -> Sweep:
    """The sweep whose results a directory holds.

    Raises
    ------
    ValueError
        It holds none.
    """
    return sweep_from(read(Path(path)))


def read(path: Path) -> dict[str, Any]:
    """What `sweep.json` tells."""
    try:
        return json.loads((path / SWEEP).read_bytes())
    except (FileNotFoundError, NotADirectoryError):
        raise reject("directory", str(path), f"a sweep's: it has no {SWEEP}") from None
    except ValueError:
        raise reject("directory", str(path), f"a sweep's: its {SWEEP} is no JSON") from None


def check_same(path: Path, asked: dict[str, Any], there: dict[str, Any]) -> None:
    """Check that a directory holds the sweep that is asked for; ValueError says what differs."""
    other = [name for name in {**there, **asked} if there.get(name) != asked.get(name)]
    if other:
        holds = f"it holds one with other {', '.join(other)}"
        bound = f"empty, or this sweep's; {holds}: take another, or delete it"
        raise reject("directory", str(path), bound)
