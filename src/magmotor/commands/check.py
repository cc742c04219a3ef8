"""Find what will fail in a model with magnets, and which settings work.

The exit code is 1 if there are findings; with --fix, if some remain.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import mujoco
import tyro

from magmotor.commands.model_file import answer, ignore_idle, is_dropped, read
from magmotor.commands.output import writes, written_whole
from magmotor.commands.parsing import parse_options
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.checking.check import NOTE, check

FOUND = 1
"""Exit code if there are findings."""


@dataclass
class Options:
    """Options of the command."""

    model: tyro.conf.Positional[Path]
    """MJCF file"""
    keyframe: str = ""
    """name of the keyframe to check; by default the model's initial state"""
    fix: Path | None = None
    """MJCF file to write: the whole model, with what is proposed; MuJoCo writes six digits"""


def main() -> None:
    """Print the findings."""
    options = parse_options(Options, __doc__)
    ignore_idle()
    answer(lambda: report(options))


def report(options: Options) -> None:
    """Print the findings; the exit code is 1 if there are some."""
    model, data = read(options.model, options.keyframe)
    if options.fix:
        write_fixed(options.model, data, options.fix)
        print(f"in {options.fix}:")
        model, data = read(options.fix, options.keyframe)
    dropped = options.model.suffix.lower() != ".mjb" and is_dropped(options.model, model)
    found = check(model, data)
    if found.findings or not dropped:  # which has been said
        print(found)
    else:
        print(*map(NOTE.format, found.notes), sep="\n")
    if found.findings or dropped:
        raise SystemExit(FOUND)


def write_fixed(path: Path, data: mujoco.MjData, target: Path) -> None:
    """Write the model of an MJCF file with the settings that `check` proposes."""
    if target.suffix.lower() != ".xml":
        raise ArgumentError("fix", str(target), "must end in .xml")
    if path.suffix.lower() == ".mjb":
        raise ArgumentError("path", str(path), "must be an MJCF file, to be fixed")
    spec: Any = mujoco.MjSpec.from_file(cast(Any, os.fsencode(path)))  # which need not be UTF-8
    print(check(spec, data, fix=True))
    here, there = path.parent.resolve(), target.parent.resolve()
    if here != there:  # to which these are relative
        for kind in ("meshdir", "texturedir"):
            setattr(spec, kind, os.fsencode(os.path.relpath(here / getattr(spec, kind), there)))
        spec.modelfiledir = os.fsencode(there / "_")[:-1]
    verb = writes(target)
    with written_whole(target) as part:
        part.write_bytes(as_xml(spec))
    print(f"{verb} {target}")


def as_xml(spec: mujoco.MjSpec) -> bytes:
    """Return the MJCF file of a spec, whose names need not be UTF-8."""
    try:
        return spec.to_xml().encode()
    except UnicodeDecodeError as error:
        return error.object
