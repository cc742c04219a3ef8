"""Silence for runs that are meant to fail."""

import threading
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import mujoco


@contextmanager
def quiet() -> Iterator[None]:
    """Silence warnings about runs that are meant to fail: MuJoCo's own, and those of magnetism."""
    with _lock:
        if not _silenced:
            _restoring.enter_context(warnings.catch_warnings())
            warnings.simplefilter("ignore")
            _restoring.callback(mujoco.set_mju_user_warning, mujoco.get_mju_user_warning())
            mujoco.set_mju_user_warning(_ignore)
        _silenced.append(None)
    try:
        yield
    finally:
        with _lock:
            _silenced.pop()
            if not _silenced:
                _restoring.close()


def _ignore(_message: str) -> None:
    pass


_lock = threading.Lock()
_silenced: list[None] = []
_restoring = ExitStack()
"""Blocks that silence warnings, of all threads, and what the last of them restores."""
