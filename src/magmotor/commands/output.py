"""What all commands share: files written whole, one-line messages, and exit codes."""

import errno
import os
import re
import shutil
import signal
import sys
import textwrap
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from io import TextIOWrapper
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any, NoReturn, TextIO, cast

from magmotor.common.environment import PACKAGES
from magmotor.common.files import whole_file
from magmotor.common.interrupts import uninterrupted
from magmotor.common.optional import MissingExtra

if TYPE_CHECKING:
    import xarray as xr

DIVERGED, MISTAKE, NO_OPENGL, UNWRITTEN, INTERRUPTED = 1, 2, 3, 4, 130
"""Exit codes."""

WIDEST = 100
"""Columns of the widest line of a help text, and of what is shown in a terminal."""


def run_program(main: Callable[[], None]) -> None:
    """Run a program; Ctrl-C, SIGTERM, a missing package or a full disk end it with one line."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # the shell has closed it
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115
    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    ):  # so that files are finished or removed, and checkpoints are saved
        signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    if isinstance(sys.stdout, TextIOWrapper):  # for paths that are not UTF-8
        sys.stdout.reconfigure(errors="surrogateescape")
    os.environ["COLUMNS"] = str(columns(sys.stdout))  # for tyro's boxes
    wraps = is_help_asked() or sys.stdout.isatty()
    output = cast(TextIO, Wrapped(sys.stdout)) if wraps else sys.stdout
    try:
        try:
            with redirect_stdout(output):
                main()
        finally:  # also after SystemExit, or the interpreter would report a full disk
            sys.stdout.flush()
    except MissingExtra as missing:
        fail(str(missing), MISTAKE)
    except KeyboardInterrupt:
        fail("interrupted; all files reported as written are complete", INTERRUPTED)
    except OSError as error:
        if error.errno not in (errno.EPIPE, errno.ENOSPC):
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if error.errno == errno.ENOSPC:
            fail(f"cannot write: {error.strerror}", UNWRITTEN)
        raise SystemExit(UNWRITTEN) from None  # nobody reads the output any more


def is_help_asked() -> bool:
    """Whether the arguments of the program ask for help."""
    return bool({"-h", "--help"} & set(sys.argv))


def columns(stream: TextIO) -> int:
    """Return the width of a terminal, at most `WIDEST`; of any other stream, that in COLUMNS."""
    if stream.isatty():
        try:
            return min(WIDEST, os.get_terminal_size(stream.fileno()).columns or WIDEST)
        except (OSError, ValueError):
            return WIDEST
    return min(WIDEST, shutil.get_terminal_size((WIDEST, 24)).columns)


def wrapped(text: str, width: int) -> str:
    """Wrap long lines between words, except in tables and tyro's boxes."""
    return "\n".join(_wrapped_line(line, width) for line in text.split("\n"))


def _wrapped_line(line: str, width: int) -> str:
    cells = list(re.finditer(r"(?<=\S) {2,}", line))
    if len(line) <= width or "│" in line or len(cells) > 1:
        return line
    indent = cells[0].end() if cells else len(line) - len(line.lstrip())
    return textwrap.fill(
        line,
        width,
        subsequent_indent=" " * min(indent, width // 2),
        break_long_words=False,
        break_on_hyphens=False,
    )


class Wrapped:
    """A stream whose long lines are wrapped, except what is written by `write_verbatim`."""

    def __init__(self, stream: TextIO):
        self.stream = stream

    def write(self, text: str) -> int:
        return self.stream.write(wrapped(text, columns(self.stream)))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def write_verbatim(text: str) -> None:
    """Write text whose lines must stay whole, such as a program, to stdout."""
    stream = sys.stdout.stream if isinstance(sys.stdout, Wrapped) else sys.stdout
    stream.write(text)


def warn_in_one_line() -> None:
    """Show each warning once, in one line without source code."""
    shown = set()

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        if str(message) not in shown:
            shown.add(str(message))
            report(str(message))

    warnings.showwarning = show


def report(message: str) -> None:
    """Print a line on stderr, such as a warning of MuJoCo, which it would write to a file."""
    line = f"{Path(sys.argv[0]).name}: {printable(message)}"
    shown = wrapped(line, columns(sys.stderr)) if sys.stderr.isatty() else line
    print(shown, file=sys.stderr)


def fail(message: str, code: int) -> NoReturn:
    """End the program with a message on stderr and an exit code."""
    report(message)
    raise SystemExit(code)


def printable(text: str) -> str:
    """Escape control characters in untrusted text before it is printed."""
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)


def refuse_file(path: Path) -> None:
    """End the program if there is a file where a folder belongs."""
    if path.exists() and not path.is_dir():
        fail(f"cannot write to {path}: it is a file, not a folder", UNWRITTEN)


def make_folder(path: Path) -> None:
    """Create a writable folder if it does not exist; end the program if that fails."""
    refuse_file(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=path):
            pass
    except OSError as error:
        fail(f"cannot write to {path}: {error.strerror or error}", UNWRITTEN)


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Yield a path to write to, whose file gets its name only when it is complete."""
    make_folder(path.parent)
    try:
        with whole_file(path) as part:
            yield part
    except OSError as error:
        full = error.errno == errno.EACCES and shutil.disk_usage(path.parent).free == 0  # netCDF's
        reason = os.strerror(errno.ENOSPC) if full else error.strerror or error
        fail(f"cannot write {path}: {reason}", UNWRITTEN)
    except RuntimeError as error:
        if not str(error).startswith("NetCDF"):
            raise
        fail(f"cannot write {path}: {error}; is the disk full?", UNWRITTEN)


def write_netcdf(data: "xr.Dataset", path: Path, encoding: Any = None) -> None:
    """Write a dataset atomically; ends the program as `written_whole` does."""
    # Interrupted inside HDF5's lock, xarray would wait for that lock forever.
    with uninterrupted(), written_whole(path) as part:
        data.to_netcdf(part, encoding=encoding)


def read_netcdf(path: Path) -> "xr.Dataset":
    """Read a dataset into memory; ends the program if that fails."""
    import xarray as xr

    if path.exists() and not path.is_file():
        fail(f"cannot read {path}: it is not a file", MISTAKE)
    try:
        with uninterrupted():
            return xr.load_dataset(path, engine="netcdf4")
    except (OSError, RuntimeError, ValueError) as error:
        fail(f"cannot read {path}: {getattr(error, 'strerror', None) or error}", MISTAKE)


@contextmanager
def film_written(path: Path) -> Iterator[Path]:
    """Yield a path as `written_whole` does, for a movie; reports success or why it failed."""
    import magmotor as mm

    verb = writes(path)
    try:
        with written_whole(path) as part:
            yield part
    except mm.render.NoOpenGL as error:
        if os.environ.get("MUJOCO_GL") == "glfw":  # no package helps
            fail(f"no movie: {error}", NO_OPENGL)
        packages = "".join(f"\n  {system}: {command}" for system, command in PACKAGES.items())
        fail(f"no movie: {error}; install OpenGL and run again{packages}", NO_OPENGL)
    except RuntimeError as error:
        fail(f"no movie: {' '.join(str(error).split())}", UNWRITTEN)
    print(f"{verb} {path}")


def writes(path: Path) -> str:
    """Return what a command does that now writes a file: it may replace that of an older run."""
    return "replaced" if path.exists() else "wrote"
