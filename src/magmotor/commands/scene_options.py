"""Scenes on the command line: a preset or a file, and a flag for each field."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, make_dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

import tyro

import magmotor as mm
from magmotor.commands.output import MISTAKE, fail, is_help_asked
from magmotor.commands.parsing import one_line_errors
from magmotor.common.checks import check_choice, did_you_mean
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.device.quantities import is_quantity
from magmotor.devices.motor.scene import PAPER as RUNS

Options = TypeVar("Options")


@dataclass(frozen=True)
class Presets:
    """Named initial values for the flags of a scene class."""

    scenes: dict[str, Any]
    default: str
    help: str
    decide: tuple[str, ...] = ()
    """fields without a flag, since the preset sets them"""


KINDS = {"top": mm.Top, "motor": mm.Motor, "disk": mm.Disk}
"""Scene classes by their names on the command line."""

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
    allowed: str = "",
) -> tuple[Any, Options]:
    """Parse a scene and a command's own options from the command line.

    The first argument is one of `kinds`: top, motor or disk, each possibly with its own options, or
    a command without a scene. Every field of the scene has a flag, whose default comes from the
    preset or from a file. An invalid value ends the program with one line and code 2. `allowed`
    says what else than `kinds` a command accepts as first argument, in the message about another.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        own = options if isinstance(options, Mapping) else dict.fromkeys(kinds, options)
        commands = {kind: _scene_command(kind, own[kind], arguments) for kind in kinds}
        for kind, command in commands.items():
            if kind in KINDS:  # the help of all of them has the description once
                summary = (KINDS[kind].__doc__ or "").partition("\n")[0]
                command.__doc__ = description if kind in arguments[:1] else summary
        if not is_help_asked():
            check_kind(arguments, kinds, allowed)
        with one_line_errors(arguments, kinds):
            made = tyro.extras.subcommand_cli_from_dict(
                commands, description=description, args=arguments
            )
        return made()
    except ValueError as error:
        fail(str(error), MISTAKE)


def check_kind(arguments: Sequence[str], kinds: Sequence[str], allowed: str) -> None:
    """Check that the first argument is one of these words, which `allowed` lists unless empty.

    Raises
    ------
    ValueError
        It is another word, or an option.
    """
    first = arguments[0] if arguments else ""
    if first in kinds:
        return
    *others, last = kinds
    listed = f"{', '.join(others)} or {last}"
    known = f"the first argument must be {allowed or listed}"
    if not first or first.startswith("-"):
        raise InputError(f"{known}; see {sys.argv[0]} --help")
    scene = [kind for kind in kinds if kind in KINDS]
    file = f"; a scene's file needs its kind: {scene[0]} --scene {first}" if scene else ""
    raise InputError(
        f"{first!r}{did_you_mean(first, kinds)}: {known}{file * first.lower().endswith('.toml')}"
    )


def _scene_command(kind: str, options: type[Options], arguments: Sequence[str]) -> Any:
    if kind not in KINDS:
        return _sceneless_command(options)
    presets = PRESETS.get(kind)
    # Preset and file are parsed first, since they provide the defaults of the other flags.
    origin = _origin(presets)
    first = arguments if [*arguments[:1]] == [kind] else []
    with one_line_errors(arguments):
        given = tyro.cli(origin, args=first, return_unknown_args=True, add_help=False)[0]
    if given.scene is not None:
        if any(argument.partition("=")[0] == "--preset" for argument in arguments):
            raise ArgumentError(
                "preset", given.preset, "cannot be given with --scene, which is a file"
            )
        base = _scene_in(given.scene, KINDS[kind])
    elif presets is not None:
        check_choice("preset", given.preset, tuple(presets.scenes))
        base = presets.scenes[given.preset]
    else:
        base = KINDS[kind]()
    decided = () if presets is None else presets.decide
    names = [name for name in _declared(base) if name not in decided]
    return scene_command(base, names, options, origin)


def _origin(presets: Presets | None) -> Any:
    """Make a dataclass, for tyro, of the flags that say where a scene comes from."""
    file = tyro.conf.arg(
        metavar="FILE.toml", help="read the initial values of the scene's fields from this file"
    )
    flags: list[Any] = [("scene", Annotated[Path | None, file], field(default=None))]
    if presets is not None:
        named = tyro.conf.arg(metavar="|".join(presets.scenes), help=presets.help)
        flags.insert(0, ("preset", Annotated[str, named], field(default=presets.default)))
    return make_dataclass("Origin", flags)


def _scene_in(path: Path, kind: type) -> Any:
    """Return the scene in a file; it must be of this class."""
    try:
        scene = mm.read_scene(path)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from None
    if not isinstance(scene, kind):
        raise InputError(f"{path} has a {type(scene).__name__}: must have a {kind.__name__}")
    return scene


def _sceneless_command(options: type[Options]) -> Any:
    def command(own: Annotated[options, tyro.conf.arg(name="")]):  # pyright: ignore[reportInvalidTypeForm]
        return lambda: (None, own)

    command.__doc__ = options.__doc__
    return command


def scene_command(base: Any, names: Sequence[str], options: type[Options], origin: type) -> Any:
    """Make a command for tyro whose result returns a scene and a command's own options.

    It has flags for the named fields of the scene `base`, for `options`, and for `origin`, which
    says where the scene comes from.
    """
    flags = _flags(base, names)

    def command(
        own: Annotated[options, tyro.conf.arg(name="")],  # pyright: ignore[reportInvalidTypeForm]
        origin: tyro.conf.OmitArgPrefixes[origin],  # pyright: ignore[reportInvalidTypeForm]
        scene: tyro.conf.OmitArgPrefixes[flags],  # pyright: ignore[reportInvalidTypeForm]
    ):
        return lambda: (base.replace(**vars(scene)), own)

    return command


def _declared(scene: Any) -> list[str]:
    return [f.name for f in fields(scene) if is_quantity(f)]


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
