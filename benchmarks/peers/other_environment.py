"""Peers that run in an environment of their own, .venv-bench."""

import json
import subprocess
from pathlib import Path

HERE = Path(__file__).parent
PYTHON = HERE.parents[1] / ".venv-bench" / "bin" / "python"


class NotThere(Exception):
    """The environment or what the module imports is missing; says why."""


class Peer:
    """A module of this folder whose process measures when it is told to; see turns.py."""

    def __init__(self, module: str, python: Path = PYTHON):
        if not python.exists():
            raise NotThere(f"no {python.parts[-3]}")
        self._process = subprocess.Popen(
            [str(python), str(HERE / "turns.py"), module],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.replicas: dict[str, int] = self._hear()

    def seconds(self, name: str) -> float:
        """Seconds of a trajectory-step."""
        assert self._process.stdin
        print(json.dumps(name), file=self._process.stdin, flush=True)
        return self._hear()

    def close(self) -> None:
        """End the program."""
        self._process.communicate()

    def _hear(self):
        assert self._process.stdout
        line = self._process.stdout.readline()
        if line:
            return json.loads(line)
        errors = self._process.communicate()[1].strip().splitlines()
        raise NotThere(errors[-1] if errors else "it ended")
