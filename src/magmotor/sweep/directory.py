"""The directory of a sweep: one file a case, each whole or not there.

`sweep.json` tells what the sweep is; `done/ab/KEY.json` (`.nc` where whole runs are recorded) holds
what was measured in the case of that key, `failed/KEY.json` why another failed. Each file has a
checksum, is written in `parts/`, and takes its name when it is on the disk. `claims/KEY` says who
computes a case. What is read may be anybody's: no symbolic link is followed, no name is imported.
"""

import json
import os
import stat
import threading
import warnings
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from magmotor.common.checks import reject
from magmotor.common.files import is_dead, this_driver, write_whole
from magmotor.sweep.case import Case, canonical
from magmotor.sweep.definition import Sweep, sweep_from
from magmotor.sweep.measures import TRAJECTORY
from magmotor.sweep.sealed import Damaged, naming, opened, opened_bytes, sealed
from magmotor.sweep.worker import Outcome

SWEEP = "sweep.json"
FOLDERS = {"parts", "claims", "done", "failed"}


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
        told = json.loads(canonical(sweep.as_json()))
        others = _other_things(path)
        if not (path / SWEEP).exists():  # asked last: another driver may have begun meanwhile
            if others:
                raise reject(
                    "directory", str(path), f"must be empty, or this sweep's; it holds {others[0]}"
                )
            path.mkdir(parents=True, exist_ok=True)
            self._write(Path(SWEEP), sealed(told))
        try:
            there = _told(path)
        except Damaged as damage:
            # Results go by keys that hash all that makes them: none can be taken for another's.
            warnings.warn(f"{damage}; it is written again", stacklevel=2)
            self._write(Path(SWEEP), sealed(told))
        else:
            check_same(path, told, there)

    def result(self, case: Case) -> Any:
        """What a case's result file holds, entries of JSON or bytes of netCDF; None without one.

        Raises
        ------
        Damaged
            The file is not what was written.
        """
        return self._opened(self.done(case), case)

    def error(self, case: Case) -> str | None:
        """Why a case failed, if it did.

        Raises
        ------
        Damaged
            The file that says so is not what was written.
        """
        found = self._opened(Path("failed", f"{case.key}.json"), case)
        return None if found is None else str(found.get("error"))

    def done(self, case: Case) -> Path:
        """Where a case's result file is, below the directory."""
        return Path("done", case.key[:2], f"{case.key}{self.suffix}")

    def _opened(self, file: Path, case: Case) -> Any:
        with naming(file):
            try:
                content = _content(self.path, file)
            except FileNotFoundError:
                return None
            if file.suffix == ".nc":
                return opened_bytes(content, case.key)
            found = opened(content)
            if found.get("case") != case.spec:
                raise Damaged("it is another case's")
        return found

    def claim(self, case: Case) -> bool:
        """Tell other drivers that a case is under way; False if another was first."""
        claim = Path("claims", case.key)
        try:
            with self._place(claim).open("x") as file:
                self.claims.add(claim)
                file.write(this_driver())
        except FileExistsError:
            return False
        return True

    def take_back_claims(self) -> None:
        """Leave to others what is not done."""
        for claim in self.claims:
            self._remove(claim)

    def keep(self, case: Case, outcome: Outcome) -> None:
        """Write what came of a case.

        Raises
        ------
        OSError
            It cannot be written; all that was written before is there.
        """
        failed = Path("failed", f"{case.key}.json")
        if outcome.error is None:
            assert outcome.content is not None
            self._write(self.done(case), outcome.content)
            for old in (failed, failed.with_suffix(".nc")):
                self._remove(old)
        else:
            if outcome.content is not None:
                self._write(failed.with_suffix(".nc"), outcome.content)
            self._write(failed, sealed({"case": case.spec, "error": outcome.error}))
        claim = Path("claims", case.key)
        self._remove(claim)
        self.claims.discard(claim)

    def _remove(self, file: Path) -> None:
        """Remove a file, if it is there."""
        _check_inside(self.path, file)
        (self.path / file).unlink(missing_ok=True)

    def _place(self, file: Path) -> Path:
        """The path of a file to be written, whose folder is made."""
        _check_inside(self.path, file)
        path = self.path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def _write(self, file: Path, content: bytes) -> None:
        # Several threads of a driver may write the same file.
        name = f"{file.name}.{threading.get_ident()}@{this_driver()}"
        part = self._place(Path("parts", name))
        part.unlink(missing_ok=True)  # it may be a link
        write_whole(self._place(file), content, part)

    def remove_what_the_dead_left(self) -> None:
        """Remove half-written files and claims of this machine's drivers that were killed."""
        for name in ("parts", "claims"):
            _check_inside(self.path, Path(name, "any"))
        for part in self.path.glob("parts/*"):
            if is_dead(part.name.rpartition("@")[2]):
                with suppress(OSError):
                    part.unlink()
        for claim in self.path.glob("claims/*"):
            with suppress(OSError, ValueError):
                if is_dead(_content(self.path, Path("claims", claim.name)).decode()):
                    claim.unlink()


def _check_inside(root: Path, file: Path) -> None:
    """Check that no symbolic link on the way to a file leads out of the sweep's directory."""
    for folder in [*file.parents][:-1]:
        if (root / folder).is_symlink():
            sentence = "must be a folder: a sweep follows no symbolic link out of its directory"
            raise reject("directory", str(root / folder), sentence)


def _content(root: Path, file: Path) -> bytes:
    """What a file of a sweep, named from its directory on, holds.

    Raises
    ------
    FileNotFoundError
        It is not there.
    Damaged
        It is no regular file, or cannot be read.
    """
    _check_inside(root, file)
    path = root / file
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            raise Damaged("it is no regular file")
        return path.read_bytes()
    except FileNotFoundError:
        raise
    except OSError as error:
        raise Damaged(str(error.strerror)) from None


def _other_things(path: Path) -> list[str]:
    """Names in a directory, if it is there, but for those of a sweep that has lost `sweep.json`.

    Results go by keys that hash all that makes them, so that none can be taken for another's.
    """
    try:
        found = [file.name for file in path.iterdir() if file.name not in FOLDERS]
        return sorted(found + [file.name for file in path.glob("parts/*") if "@" not in file.name])
    except FileNotFoundError:
        return []
    except NotADirectoryError:
        raise reject("directory", str(path), "must be a directory") from None


def _told(folder: Path) -> dict[str, Any]:
    """What `sweep.json` tells; errors as of `_content`."""
    with naming(Path(SWEEP)):
        return opened(_content(folder, Path(SWEEP)))


def folder_of(directory: Any) -> Path:
    """A directory as a path; ValueError if it is no name of one."""
    if not isinstance(directory, str | os.PathLike) or "\0" in str(directory):
        raise reject("directory", directory, "must be the name of a directory")
    return Path(directory)


def open_directory(path: str | Path) -> Directory:
    """The directory of a sweep that is there; ValueError if there is none."""
    return Directory(folder_of(path), sweep_of(path))


def sweep_of(path: str | Path, *, measures: Iterable[str] = ()) -> Sweep:
    """The sweep whose results a directory holds.

    Parameters
    ----------
    path : str or Path
    measures : iterable of str
        Those of its measures `package.module:function` that may be imported, so that the sweep can
        be run. Nothing is imported because a file names it.

    Raises
    ------
    ValueError
        The directory holds no sweep, or `measures` names what is not among its measures.
    """
    folder = folder_of(path)
    try:
        return sweep_from(_told(folder), measures=measures)
    except (FileNotFoundError, NotADirectoryError):
        raise reject("directory", str(path), f"must be a sweep's: it has no {SWEEP}") from None
    except Damaged as damage:
        sentence = f"must be a sweep's: {damage}; the same sweep, run again, mends it"
        raise reject("directory", str(path), sentence) from None


def check_same(path: Path, asked: dict[str, Any], there: dict[str, Any]) -> None:
    """Check that a directory holds the sweep that is asked for; ValueError says what differs."""
    other = [name for name in {**there, **asked} if there.get(name) != asked.get(name)]
    if other:
        holds = f"it holds one with other {', '.join(other)}"
        sentence = f"must be empty, or this sweep's; {holds}: take another, or delete it"
        raise reject("directory", str(path), sentence)


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
