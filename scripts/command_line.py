"""Shared by the scripts: scenes from typed flags, atomic file writes, and one-line errors."""

import os
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import Field, dataclass, field, fields, make_dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import Annotated, Any, NoReturn, TypeVar

import tyro
import xarray as xr

import magmotor as mm
from magmotor.common.checks import check_choice
from magmotor.common.environment import PACKAGES
from magmotor.common.files import whole_file
from magmotor.common.interrupts import uninterrupted
from magmotor.devices.motor.scene import PAPER as RUNS

sys.path.insert(0, str(Path(__file__).parents[1]))  # where the folder paper is

DIVERGED, MISTAKE, NO_OPENGL, UNWRITTEN, INTERRUPTED = 1, 2, 3, 4, 130
"""Exit codes."""

Options = TypeVar("Options")
Scene = TypeVar("Scene", mm.Top, mm.Disk, mm.Motor)


@dataclass(frozen=True)
class Presets:
    """Named initial values for the flags of a scene class."""

    scenes: dict[str, Any]
    default: str
    help: str
    decide: tuple[str, ...] = ()
    """fields without a flag, since the preset sets them"""


@dataclass
class Unnamed:
    """Stands for the preset of scenes without presets."""


PRESETS = {
    "top": Presets(
        {
            **{f"paper{case}": mm.Top.paper(case) for case in (1, 2, 3, 4)},
            "experiment": mm.Top.experiment(),
            "turning": mm.Top.turning(),
            "si": mm.Top.si(),
        },
        default="paper4",
        help="initial values of the scene's fields: a case of the paper (4 acquires spin), its"
        " experiment (the ring is lowered, then tilted), a tilt that turns once around in 60 s, or"
        " case 4 with the moments read in SI",
    ),
    "motor": Presets(
        {**{run: mm.Motor.paper(run) for run in RUNS}, "si": mm.Motor.si()},
        default="uniform-a",
        help="initial values of the scene's fields: a run of the paper, at uniform or nonuniform"
        " temperature, or uniform-a with the moments read in SI",
        decide=("temperature",),
    ),
}
"""Presets by the command-line name of the scene class."""


def parse(
    options: type[Options] | Mapping[str, type[Options]],
    description: str,
    kinds: Sequence[str],
    arguments: Sequence[str] | None = None,
) -> tuple[Any, Options]:
    """Parse a scene and a script's own options from the command line.

    The first argument is one of `kinds`: top, motor or disk, each possibly with its own options, or
    a command without a scene. Every field of the scene has a flag, whose default comes from the
    preset. An invalid value ends the program with one line and code 2.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        own = options if isinstance(options, Mapping) else dict.fromkeys(kinds, options)
        commands = {kind: _scene_command(kind, own[kind], arguments) for kind in kinds}
        for command in commands.values():
            command.__doc__ = command.__doc__ or description
        return tyro.extras.subcommand_cli_from_dict(
            commands, description=description, args=arguments
        )()
    except ValueError as error:
        fail(str(error), MISTAKE)


def parse_fields(
    scene: Scene,
    names: Sequence[str],
    options: type[Options],
    description: str,
    arguments: Sequence[str] | None = None,
) -> tuple[Scene, Options]:
    """Parse flags for the named fields of a scene, and a script's own options; see `parse`."""
    try:
        command = _command(scene, names, options)
        return tyro.cli(command, description=description, args=arguments)()
    except ValueError as error:
        fail(str(error), MISTAKE)


def _scene_command(kind: str, options: type[Options], arguments: Sequence[str]) -> Any:
    if kind == "disk":
        return _command(mm.Disk(), _declared(mm.Disk()), options)
    if kind not in PRESETS:
        return _sceneless_command(options)
    presets = PRESETS[kind]
    argument = tyro.conf.arg(metavar="|".join(presets.scenes), help=presets.help)
    chosen = field(default=presets.default)
    named = make_dataclass("Preset", [("preset", Annotated[str, argument], chosen)])
    # The preset is parsed first, since it provides the defaults of the other flags.
    first = arguments if [*arguments[:1]] == [kind] else []
    preset = tyro.cli(named, args=first, return_unknown_args=True, add_help=False)[0].preset
    check_choice("preset", preset, tuple(presets.scenes))
    base = presets.scenes[preset]
    names = [name for name in _declared(base) if name not in presets.decide]
    return _command(base, names, options, named)


def _sceneless_command(options: type[Options]) -> Any:
    def command(own: Annotated[options, tyro.conf.arg(name="")]):  # pyright: ignore[reportInvalidTypeForm]
        return lambda: (None, own)

    command.__doc__ = options.__doc__
    return command


def _command(base: Any, names: Sequence[str], options: type[Options], named: Any = Unnamed) -> Any:
    flags = _flags(base, names)

    def command(
        own: Annotated[options, tyro.conf.arg(name="")],  # pyright: ignore[reportInvalidTypeForm]
        preset: tyro.conf.OmitArgPrefixes[named],  # pyright: ignore[reportInvalidTypeForm]
        scene: tyro.conf.OmitArgPrefixes[flags],  # pyright: ignore[reportInvalidTypeForm]
    ):
        return lambda: (base.replace(**vars(scene)), own)

    return command


def _declared(scene: Any) -> list[str]:
    return [f.name for f in fields(scene) if f.metadata]


def _flags(scene: Any, names: Sequence[str]) -> Any:
    """Make a dataclass of the named fields for tyro."""
    declared = {f.name: f for f in fields(scene)}
    return make_dataclass("Scene", [_flag(declared[name], scene) for name in names])


def _flag(declared: Field, scene: Any):
    unit = declared.metadata["unit"]
    unit = f" ({unit})" if unit not in ("", "1") else ""
    argument = tyro.conf.arg(help=declared.metadata["doc"] + unit)
    value = getattr(scene, declared.name)
    # On the command line, a potential can only be given by name.
    kind: Any = str if isinstance(value, str) else declared.type
    return declared.name, Annotated[kind, argument], field(default=value)


def run_script(main: Callable[[], None]) -> None:
    """Run a script; an unhandled Ctrl-C ends it with one line."""
    try:
        main()
    except KeyboardInterrupt:
        fail("interrupted; all files reported as written are complete", INTERRUPTED)
    except BrokenPipeError:  # nobody reads the output any more
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(UNWRITTEN) from None


def warn_in_one_line() -> None:
    """Show each warning once, in one line without source code."""
    shown = set()

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        if str(message) not in shown:
            shown.add(str(message))
            print(f"{Path(sys.argv[0]).name}: {message}", file=sys.stderr)

    warnings.showwarning = show


def fail(message: str, code: int) -> NoReturn:
    """End the program with a message on stderr and an exit code."""
    print(f"{Path(sys.argv[0]).name}: {printable(message)}", file=sys.stderr)
    raise SystemExit(code)


def printable(text: str) -> str:
    """Escape control characters in untrusted text before it is printed."""
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)


def make_folder(path: Path) -> None:
    """Create a writable folder if it does not exist; end the program if that fails."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=path):
            pass
    except FileExistsError:
        fail(f"cannot write to {path}: it is a file, not a folder", 1)
    except OSError as error:
        fail(f"cannot write to {path}: {error.strerror or error}", 1)


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Yield a path to write to, whose file gets its name only when it is complete."""
    make_folder(path.parent)
    try:
        with whole_file(path) as part:
            yield part
    except OSError as error:
        fail(f"cannot write {path}: {error.strerror or error}", 1)
    except RuntimeError as error:
        if not str(error).startswith("NetCDF"):
            raise
        fail(f"cannot write {path}: {error}; is the disk full?", 1)


def write_netcdf(data: xr.Dataset, path: Path, encoding: Any = None) -> None:
    """Write a dataset atomically; ends the program as `written_whole` does."""
    # Interrupted inside HDF5's lock, xarray would wait for that lock forever.
    with uninterrupted(), written_whole(path) as part:
        data.to_netcdf(part, encoding=encoding)


@contextmanager
def film_written(path: Path) -> Iterator[Path]:
    """Yield a path as `written_whole` does, for a movie; reports success or why it failed."""
    try:
        with written_whole(path) as part:
            yield part
    except mm.render.NoOpenGL as error:
        packages = "".join(f"\n  {system}: {command}" for system, command in PACKAGES.items())
        fail(f"no movie: {error}; install OpenGL and run again{packages}", NO_OPENGL)
    except RuntimeError as error:
        fail(f"no movie: {' '.join(str(error).split())}", UNWRITTEN)
    print(f"wrote {path}")
