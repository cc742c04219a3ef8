"""Other libraries that run in a separate environment, .venv-bench."""

import json
import subprocess
from pathlib import Path
from typing import Any, NoReturn

from benchmarks.harness.records import Record

FOLDER = Path(__file__).parent
PYTHON = FOLDER.parents[1] / ".venv-bench" / "bin" / "python"


class Unavailable(Exception):
    """The environment or a module's import is missing; the message says which."""


class Peer:
    """A module of this folder whose process measures on request; see server.py."""

    def __init__(self, module: str):
        self._process = _start(module)
        self.replicas: dict[str, int] = self._receive()

    def seconds(self, name: str) -> float:
        """Return the seconds per trajectory-step."""
        assert self._process.stdin
        print(json.dumps(name), file=self._process.stdin, flush=True)
        return self._receive()

    def close(self) -> None:
        """End the process."""
        self._process.communicate()

    def _receive(self):
        assert self._process.stdout
        line = self._process.stdout.readline()
        return json.loads(line) if line else _fail(self._process.communicate()[1])


def answer_of(module: str, **question: Any) -> Record:
    """Return the answer of a module of this folder, or, as `failed`, why there is none."""
    try:
        answer, errors = _start(module).communicate(json.dumps(question) + "\n")
        return json.loads(answer.splitlines()[-1]) if answer else _fail(errors)
    except Unavailable as error:
        return {"failed": f"not measured: {error}"}


def _start(module: str) -> subprocess.Popen[str]:
    if not PYTHON.exists():
        raise Unavailable(f"no {PYTHON.parts[-3]}")
    return subprocess.Popen(
        [str(PYTHON), str(FOLDER / "server.py"), module],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def _fail(errors: str) -> NoReturn:
    lines = errors.strip().splitlines()
    raise Unavailable(lines[-1] if lines else "the process ended")
