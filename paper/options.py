"""The command line of the programs of the devices: a flag for some fields of a scene."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import magmotor as mm
from magmotor.commands.output import MISTAKE, fail
from magmotor.commands.parsing import parse_options
from magmotor.commands.scene_options import scene_command

Options = TypeVar("Options")
Scene = TypeVar("Scene", mm.Disk, mm.Motor)


@dataclass
class NoOrigin:
    """Stands for preset and file, since the scene is known."""


def parse_fields(
    scene: Scene,
    names: Sequence[str],
    options: type[Options],
    description: str,
) -> tuple[Scene, Options]:
    """Parse flags for the named fields of a scene, and a program's own options."""
    try:
        command = scene_command(scene, names, options, NoOrigin)
        return parse_options(command, description)()
    except ValueError as error:
        fail(str(error), MISTAKE)
