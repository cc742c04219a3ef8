"""Other libraries that run in a separate environment, .venv-bench."""

import json
import subprocess
from pathlib import Path

FOLDER = Path(__file__).parent
PYTHON = FOLDER.parents[1] / ".venv-bench" / "bin" / "python"


class Unavailable(Exception):
    """The environment or a module's import is missing; the message says which."""


class Peer:
    """A module of this folder whose process measures on request; see server.py."""

    def __init__(self, module: str, python: Path = PYTHON):
        if not python.exists():
            raise Unavailable(f"no {python.parts[-3]}")
        self._process = subprocess.Popen(
            [str(python), str(FOLDER / "server.py"), module],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
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
        if line:
            return json.loads(line)
        errors = self._process.communicate()[1].strip().splitlines()
        raise Unavailable(errors[-1] if errors else "the process ended")
