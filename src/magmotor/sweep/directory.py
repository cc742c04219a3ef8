"""The directory of a sweep: one file per case, either complete or absent.

`sweep.json` holds the specification of the sweep; `done/ab/KEY.json` (`.nc` if whole runs are
recorded) the result of the case with that key; `failed/KEY.json` the error of a failed case. Each
file has a checksum, is written in `parts/`, and moves to its place once it is on the disk.
`claims/KEY` names the driver that computes a case. All files are untrusted: no symbolic link is
followed, and no name is imported.
"""

import errno
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

from magmotor.common.exceptions import ArgumentError
from magmotor.common.files import is_dead, this_driver, write_whole
from magmotor.common.hints import check_path
from magmotor.common.integrity import (
    Damaged,
    canonical,
    naming_damage,
    verified,
    verified_bytes,
    with_checksum,
)
from magmotor.sweep.case import Case
from magmotor.sweep.compute import Outcome
from magmotor.sweep.definition import Sweep, sweep_from
from magmotor.sweep.measures import TRAJECTORY

SWEEP = "sweep.json"
FOLDERS = {"parts", "claims", "done", "failed"}

GONE = "was moved or removed while the sweep ran"

ANOTHER = "give this sweep another folder (on the command line, --out)"


class Directory:
    """A sweep's results on disk.

    Parameters
    ----------
    path : Path
        Created, with its parents, if it does not exist.
    sweep : Sweep

    Raises
    ------
    ValueError
        The directory holds another sweep or unrelated files.
    OSError
        The directory is not writable.
    """

    def __init__(self, path: Path, sweep: Sweep):
        self.path, self.sweep = path, sweep
        self.claims: set[Path] = set()
        self.suffix = ".nc" if sweep.measure == (TRAJECTORY,) else ".json"
        spec = json.loads(canonical(sweep.as_json()))
        unrelated = _unrelated_files(path)
        if not (path / SWEEP).exists():  # checked last: another driver may have begun meanwhile
            if unrelated:
                sentence = f"must be empty or hold this sweep; it holds {unrelated[0]}: {ANOTHER}"
                raise ArgumentError("directory", str(path), sentence)
            path.mkdir(parents=True, exist_ok=True)
            self._write(Path(SWEEP), with_checksum(spec))
        self._inode = _inode(path)
        try:
            stored = _stored_spec(path)
        except Damaged as damage:
            # Keys of results hash their full specification, so results cannot be confused.
            warnings.warn(f"{damage}; it is written again", stacklevel=2)
            self._write(Path(SWEEP), with_checksum(spec))
        else:
            _check_same(path, spec, stored)

    def result(self, case: Case) -> Any:
        """Return the content of a case's result file, JSON entries or netCDF bytes; None if absent.

        Raises
        ------
        Damaged
            The file is not what was written.
        """
        return self._verified(self.done(case), case)

    def error(self, case: Case) -> str | None:
        """Return the error of a failed case; None if it has not failed.

        Raises
        ------
        Damaged
            The file is not what was written.
        """
        found = self._verified(Path("failed", f"{case.key}.json"), case)
        return None if found is None else str(found.get("error"))

    def done(self, case: Case) -> Path:
        """Return the path of a case's result file, relative to the directory."""
        return Path("done", case.key[:2], f"{case.key}{self.suffix}")

    def _verified(self, file: Path, case: Case) -> Any:
        with naming_damage(file):
            try:
                content = _content(self.path, file)
            except FileNotFoundError:
                return None
            if file.suffix == ".nc":
                return verified_bytes(content, case.key)
            found = verified(content)
            if found.get("case") != case.spec:
                raise Damaged("it belongs to another case")
        return found

    def claim(self, case: Case) -> bool:
        """Claim a case before other drivers compute it; False if another driver has claimed it."""
        self._check_in_place()
        claim = Path("claims", case.key)
        try:
            with self._path_to_write(claim).open("x") as file:
                self.claims.add(claim)
                file.write(this_driver())
        except FileExistsError:
            return False
        return True

    def release_claims(self) -> None:
        """Release the claims of unfinished cases."""
        for claim in self.claims:
            self._remove(claim)

    def keep(self, case: Case, outcome: Outcome) -> None:
        """Write the outcome of a case.

        Raises
        ------
        OSError
            It cannot be written; earlier results are intact.
        """
        self._check_in_place()
        failed = Path("failed", f"{case.key}.json")
        if outcome.error is None:
            assert outcome.content is not None
            self._write(self.done(case), outcome.content)
            for old in (failed, failed.with_suffix(".nc")):
                self._remove(old)
        else:
            if outcome.content is not None:
                self._write(failed.with_suffix(".nc"), outcome.content)
            self._write(failed, with_checksum({"case": case.spec, "error": outcome.error}))
        claim = Path("claims", case.key)
        self._remove(claim)
        self.claims.discard(claim)

    def _check_in_place(self) -> None:
        """Check that the path still leads to the directory, since results are not for another."""
        if _inode(self.path) != self._inode or not (self.path / SWEEP).exists():
            raise FileNotFoundError(errno.ENOENT, f"it {GONE}", str(self.path))

    def check_kept(self, count: int) -> None:
        """Check that the directory still has so many results; FileNotFoundError if it has fewer."""
        lost = count - sum(1 for _ in self.path.glob(f"done/*/*{self.suffix}"))
        if lost > 0:
            reason = f"{lost} of {count} results are missing: it {GONE}"
            raise FileNotFoundError(errno.ENOENT, reason, str(self.path))

    def _remove(self, file: Path) -> None:
        """Remove a file if it exists."""
        _check_inside(self.path, file)
        (self.path / file).unlink(missing_ok=True)

    def _path_to_write(self, file: Path) -> Path:
        """Return the path of a file to write, and create its folder."""
        _check_inside(self.path, file)
        for folder in [*file.parents][-2::-1]:
            (self.path / folder).mkdir(exist_ok=True)
        return self.path / file

    def _write(self, file: Path, content: bytes) -> None:
        # Several threads of a driver may write the same file.
        name = f"{file.name}.{threading.get_ident()}@{this_driver()}"
        part = self._path_to_write(Path("parts", name))
        part.unlink(missing_ok=True)  # it may be a link
        write_whole(self._path_to_write(file), content, part)

    def remove_leftovers(self) -> None:
        """Remove partial files and claims of drivers on this machine that were killed."""
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


def _inode(folder: Path) -> tuple[int, int] | None:
    """Return what identifies a folder wherever it is moved; None if there is none."""
    try:
        found = folder.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return found.st_dev, found.st_ino


def _check_inside(root: Path, file: Path) -> None:
    """Raise ValueError if a folder between the sweep's directory and a file is a symbolic link."""
    for folder in [*file.parents][:-1]:
        if (root / folder).is_symlink():
            sentence = "must be a folder: a sweep follows no symbolic link out of its folder"
            raise ArgumentError("directory", str(root / folder), sentence)


def _content(root: Path, file: Path) -> bytes:
    """Return the content of a file of a sweep, given relative to its directory.

    Raises
    ------
    FileNotFoundError
        It does not exist.
    Damaged
        It is not a regular file or cannot be read.
    ValueError
        A folder is in its place, or it is reached through a symbolic link.
    """
    _check_inside(root, file)
    path = root / file
    try:
        mode = path.lstat().st_mode
        if stat.S_ISDIR(mode):
            sentence = "must be a file: remove this folder, since a sweep never removes folders"
            raise ArgumentError("directory", str(path), sentence)
        if not stat.S_ISREG(mode):
            raise Damaged("it is not a regular file")
        return path.read_bytes()
    except FileNotFoundError:
        raise
    except OSError as error:
        raise Damaged(str(error.strerror)) from None


def _unrelated_files(path: Path) -> list[str]:
    """Return the names in a directory, if it exists, that do not belong to any sweep.

    The folders of a sweep that has lost its `sweep.json` may stay: keys of results hash their full
    specification, so results cannot be confused.
    """
    try:
        found = [file.name for file in path.iterdir() if file.name not in FOLDERS]
        return sorted(found + [file.name for file in path.glob("parts/*") if "@" not in file.name])
    except FileNotFoundError:
        return []
    except NotADirectoryError:
        raise ArgumentError("directory", str(path), "must be a folder") from None


def _stored_spec(folder: Path) -> dict[str, Any]:
    """Return the content of `sweep.json`; raises what `_content` raises."""
    with naming_damage(Path(SWEEP)):
        return verified(_content(folder, Path(SWEEP)))


def open_directory(path: str | Path) -> Directory:
    """Open the directory of an existing sweep; ValueError if it holds none."""
    return Directory(Path(check_path("directory", path)), sweep_of(path))


def sweep_of(path: str | Path, *, measures: Iterable[str] = ()) -> Sweep:
    """Return the sweep whose results a directory holds.

    Parameters
    ----------
    path : str or Path
    measures : iterable of str
        Those of its measures `package.module:function` that may be imported, which running the
        sweep requires. Nothing else is imported.

    Raises
    ------
    ValueError
        The directory holds no sweep, or `measures` names something else than its measures.
    """
    folder = Path(check_path("directory", path))
    try:
        if not os.path.isdir(folder):  # noqa: PTH112 (its own method fails on a long name)
            raise FileNotFoundError
        return sweep_from(_stored_spec(folder), measures=measures)
    except FileNotFoundError:
        sentence = f"must be the folder of a sweep: it has no {SWEEP}"
        raise ArgumentError("directory", str(path), sentence) from None
    except Damaged as damage:
        sentence = f"{damage}; running the same sweep again repairs it"
        raise ArgumentError("directory", str(path), sentence) from None


def _check_same(path: Path, spec: dict[str, Any], stored: dict[str, Any]) -> None:
    """Raise ValueError, naming what differs, if a directory holds another sweep."""
    other = [name for name in {**stored, **spec} if stored.get(name) != spec.get(name)]
    if other:
        holds = f"it holds one that differs in {', '.join(other)}"
        sentence = f"must be empty or hold this sweep; {holds}: {ANOTHER}"
        raise ArgumentError("directory", str(path), sentence)


@dataclass
class Status:
    """Numbers of cases, and the errors among them.

    Attributes
    ----------
    cases, done, failed : int
    errors : dict
        Labels of the failed cases, by error.
    damaged : list of str
        Descriptions of damaged files. Their cases count as missing: `run` recomputes them.
    """

    cases: int
    done: int = 0
    errors: dict[str, list[str]] = field(default_factory=dict)
    damaged: list[str] = field(default_factory=list)

    @property
    def failed(self) -> int:
        """Return the number of cases with an error."""
        return sum(map(len, self.errors.values()))

    @property
    def missing(self) -> int:
        """Return the number of cases with neither result nor error."""
        return self.cases - self.done - self.failed


def status(directory: str | Path) -> Status:
    """Find which cases of a sweep are done, failed or missing, and which files are damaged.

    Raises
    ------
    ValueError
        The directory holds no sweep, or its specification is damaged.
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
