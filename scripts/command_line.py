"""What the scripts share: a scene from typed flags, files written whole, and errors in one line."""

import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import Field, dataclass, field, fields, make_dataclass
from pathlib import Path
from typing import Annotated, Any, NoReturn, TypeVar

import tyro

import magmotor as mm
from magmotor.checks import check_choice

DIVERGED, MISTAKE, NO_OPENGL, UNWRITTEN, INTERRUPTED = 1, 2, 3, 4, 130
"""Exit codes."""

PRESETS = {
    "paper1": mm.Top.paper(1),
    "paper2": mm.Top.paper(2),
    "paper3": mm.Top.paper(3),
    "paper4": mm.Top.paper(4),
    "experiment": mm.Top.experiment(),
    "si": mm.Top.si(),
}

Options = TypeVar("Options")
Scene = TypeVar("Scene", mm.Top, mm.Disk)


@dataclass
class Preset:
    preset: Annotated[str, tyro.conf.arg(metavar="|".join(PRESETS))] = "paper4"
    """where the scene's fields start: a case of the paper (4 acquires spin), its experiment (the
    ring is lowered, then tilted), or case 4 with the moments read in SI"""


def parse(
    options: type[Options], description: str, arguments: Sequence[str] | None = None
) -> tuple[mm.Top, Options]:
    """The top, from a preset and a flag for each of its fields, and a script's own options.

    A field with a value that it cannot have ends the program with one line and code 2.
    """
    return _parsed({"top": _top_command(options, arguments)}, description, arguments)


def parse_any(
    options: type[Options], description: str, arguments: Sequence[str] | None = None
) -> tuple[mm.Top | mm.Disk, Options]:
    """The same for any scene that MuJoCo runs; the first argument names it."""
    commands = {
        "top": _top_command(options, arguments),
        "disk": _command(mm.Disk(), _declared(mm.Disk()), options),
    }
    return _parsed(commands, description, arguments)


def parse_fields(
    scene: Scene,
    names: Sequence[str],
    options: type[Options],
    description: str,
    arguments: Sequence[str] | None = None,
) -> tuple[Scene, Options]:
    """The scene with flags for the named fields only, and a script's own options; see `parse`."""
    try:
        command = _command(scene, names, options)
        return tyro.cli(command, description=description, args=arguments)()
    except ValueError as error:
        fail(str(error), MISTAKE)


def _parsed(commands: dict[str, Any], description: str, arguments: Sequence[str] | None) -> Any:
    try:
        for command in commands.values():
            command.__doc__ = description
        return tyro.extras.subcommand_cli_from_dict(
            commands, description=description, args=arguments
        )()
    except ValueError as error:
        fail(str(error), MISTAKE)


def _top_command(options: type[Options], arguments: Sequence[str] | None) -> Any:
    # The preset first, because the other flags have its values as their defaults.
    chosen, _ = tyro.cli(Preset, args=arguments, return_unknown_args=True, add_help=False)
    try:
        check_choice("preset", chosen.preset, tuple(PRESETS))
    except ValueError as error:
        fail(str(error), MISTAKE)
    base = PRESETS[chosen.preset]
    flags = _flags(base, _declared(base))

    def top(
        own: tyro.conf.OmitArgPrefixes[options],  # pyright: ignore[reportInvalidTypeForm]
        preset: tyro.conf.OmitArgPrefixes[Preset],
        scene: tyro.conf.OmitArgPrefixes[flags],  # pyright: ignore[reportInvalidTypeForm]
    ):
        return lambda: (base.replace(**vars(scene)), own)

    return top


def _command(base: mm.Top | mm.Disk, names: Sequence[str], options: type[Options]) -> Any:
    flags = _flags(base, names)

    def command(
        own: tyro.conf.OmitArgPrefixes[options],  # pyright: ignore[reportInvalidTypeForm]
        scene: tyro.conf.OmitArgPrefixes[flags],  # pyright: ignore[reportInvalidTypeForm]
    ):
        return lambda: (base.replace(**vars(scene)), own)

    return command


def _declared(scene: mm.Top | mm.Disk) -> list[str]:
    return [f.name for f in fields(scene) if f.metadata]


def _flags(scene: mm.Top | mm.Disk, names: Sequence[str]) -> Any:
    """A dataclass of the named fields, for tyro."""
    declared = {f.name: f for f in fields(scene)}
    return make_dataclass("Scene", [_flag(declared[name], scene) for name in names])


def _flag(declared: Field, scene: mm.Top | mm.Disk):
    unit = declared.metadata["unit"]
    unit = f" ({unit})" if unit not in ("", "1") else ""
    told = tyro.conf.arg(help=declared.metadata["doc"] + unit)
    value = getattr(scene, declared.name)
    # Of a potential, only the names are for the command line.
    kind: Any = str if isinstance(value, str) else declared.type
    return declared.name, Annotated[kind, told], field(default=value)


def run_script(main: Callable[[], None]) -> None:
    """Run a script; Ctrl-C where the script does not listen ends it with one line, too."""
    try:
        main()
    except KeyboardInterrupt:
        fail("interrupted; what is said to be written is complete", INTERRUPTED)


def warn_in_one_line() -> None:
    """Show each warning once, as the one line that it is, without the code that it comes from."""
    said = set()

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        if str(message) not in said:
            said.add(str(message))
            print(f"{Path(sys.argv[0]).name}: {message}", file=sys.stderr)

    warnings.showwarning = show


def fail(message: str, code: int) -> NoReturn:
    """End the program with a message on stderr and an exit code."""
    print(f"{Path(sys.argv[0]).name}: {message}", file=sys.stderr)
    raise SystemExit(code)


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A path to write to, which takes its name only when it is complete."""
    part = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        part.replace(path)
    except OSError as error:
        fail(f"cannot write {path}: {error.strerror or error}", 1)
    except RuntimeError as error:
        if not str(error).startswith("NetCDF"):
            raise
        fail(f"cannot write {path}: {error}; is the disk full?", 1)
    finally:
        with suppress(OSError):
            part.unlink()
