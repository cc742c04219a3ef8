"""Compiled code on disk: each file has a checksum, and its folder is one that nobody else fills.

Numba executes whatever its files contain, and raises if it cannot write one. Here, a damaged file
counts as missing, and what cannot be written is compiled anew by the next process.
"""

import hashlib
import os
import pickle
import sys
import tempfile
import threading
import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from inspect import getfile
from pathlib import Path
from typing import Any

from numba.core import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserWideCacheLocator
from numba.core.serialize import dumps

from magmotor.common.files import is_private, this_driver, write_whole

_SIZE = 4
"""Length of a checksum."""


class CodeFiles:
    """The files of a function, one for each of its signatures.

    Parameters
    ----------
    source : str
        Path of the module.
    folder : str
        NUMBA_CACHE_DIR or, without it, the user's folder for caches.
    stem : str
        Beginning of the names of the files.
    """

    def __init__(self, source: str, folder: str, stem: str):
        self._source, self._folder, self.stem = source, folder, stem

    def load(self, key: Any) -> Any:
        """Return the code for a key, or None without an undamaged file of it."""
        for folder in self._folders():
            content = self._content(Path(folder, self._name(key)))
            if content is not None:
                return pickle.loads(content)
        return None

    def save(self, key: Any, code: Any) -> None:
        """Keep the code for a key in the first folder that takes it, or say why none does."""
        pickled, reasons = dumps(code), []
        for folder in self._folders():
            path = Path(folder, self._name(key))
            part = path.with_name(f".{path.name}.{threading.get_native_id()}@{this_driver()}")
            try:
                path.parent.mkdir(mode=0o755, parents=True, exist_ok=True)
                if not self._may_use(folder):
                    raise PermissionError(0, "others can write to it")
                write_whole(path, _checksum(pickled) + pickled, part)
            except OSError as error:
                reasons.append(f"{folder}: {error.strerror}")
            else:
                return
        _explain_once("; ".join(reasons))

    def any_is_whole(self) -> bool:
        """Whether there is an undamaged file."""
        found = (Path(folder).glob(f"{self.stem}.*.nbc") for folder in self._folders())
        return any(self._content(path) is not None for paths in found for path in paths)

    def _content(self, path: Path) -> bytes | None:
        """Return what a file has behind its checksum; None if it is missing, damaged or unsafe."""
        try:
            content = path.read_bytes()
            checksum, rest = content[:_SIZE], content[_SIZE:]
            return rest if _checksum(rest) == checksum and self._may_use(str(path.parent)) else None
        except OSError:
            return None

    def _may_use(self, folder: str) -> bool:
        """Whether the user chose a folder, or nobody fills it who cannot change the module."""
        if _chosen() or not hasattr(os, "getuid"):
            return True
        return is_private(folder, like=self._source)

    def _name(self, key: Any) -> str:
        return f"{self.stem}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.nbc"

    def _folders(self) -> Iterator[str]:
        """Yield the folders in which the files may be, the preferred one first."""
        if not _chosen():
            yield str(Path(self._source).with_name("__pycache__"))
        yield self._folder
        if not _chosen() and hasattr(os, "getuid"):
            with suppress(OSError):  # no folder for temporary files
                yield f"{tempfile.gettempdir()}/magmotor-{os.getuid()}"


class _Locator(UserWideCacheLocator):
    """Names the folder without asking whether it can be written to."""

    def __init__(self, py_func: Any, py_file: str):
        super().__init__(py_func, py_file)
        if _chosen():
            self._cache_path = str(Path(_chosen(), self.get_suitable_cache_subpath(py_file)))

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> "_Locator":
        return cls(py_func, py_file)

    def ensure_cache_path(self) -> None:
        pass


class _Implementation(CompileResultCacheImpl):
    _locator_classes = (_Locator,)


class CodeCache(FunctionCache):
    """Numba's cache of a function, with these files.

    Parameters
    ----------
    function : function
    is_true : callable
        Whether the code is now what the name of the files says.
    missing : callable
        Called if the files lack code.
    """

    _impl_class = _Implementation

    def __init__(
        self,
        function: Any,
        is_true: Callable[[], bool] = lambda: True,
        missing: Callable[[], object] = lambda: None,
    ):
        super().__init__(function)
        self.files = CodeFiles(getfile(function), self.cache_path, self._impl.filename_base)
        self._cache_file: Any = self.files  # Numba's name
        self._is_true, self._missing = is_true, missing

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        found = None
        if self._is_true():
            with suppress(Exception):  # a whole file, but made with another version of Numba
                found = super()._load_overload(sig, target_context)
        if found is None:
            self._missing()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep code that has been compiled."""
        if self._is_true():
            super().save_overload(sig, data)


def _chosen() -> str:
    """Return what NUMBA_CACHE_DIR is set to."""
    return config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]


def _checksum(content: bytes) -> bytes:
    return zlib.crc32(content).to_bytes(_SIZE)


_explained = False


def _explain_once(reasons: str) -> None:
    global _explained
    if not _explained:
        _explained = True
        print(
            "magmotor: compiled code cannot be kept, and each program compiles it anew; set"
            f" NUMBA_CACHE_DIR to a folder of your own ({reasons})",
            file=sys.stderr,
            flush=True,
        )
