"""Scenes as TOML files, for people to read and edit."""

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.files import whole_file
from magmotor.device.device import SCENES, Scene
from magmotor.device.provenance import fields_of, scene_with
from magmotor.device.quantities import field_descriptions

LARGEST = 50_000
"""Largest number of characters in a file of a scene."""

_PART = r"""(?:"[^"\n]*"|'[^'\n]*'|[\w-]+)"""
DEEP = re.compile(rf"(?:^|[\[{{,])[ \t]*{_PART}(?:[ \t]*\.[ \t]*{_PART}){{5}}", re.MULTILINE)
"""A key of many tables, for which tomllib takes time in the cube of their number."""


@checked
def read_scene(path: str | Path) -> Scene:
    """Return the scene that a TOML file describes.

    Parameters
    ----------
    path : str or Path
        The file. Its key `scene` is the name of the class; every other key is a field. Fields that
        are left out have the defaults of the class. Nothing in the file is executed.

    Raises
    ------
    ValueError
        The file is not TOML, or a field is unknown or invalid; the message names file and field.
    OSError
        The file cannot be read.

    Examples
    --------
    >>> import magmotor as mm
    >>> from pathlib import Path
    >>> _ = Path("my_top.toml").write_text('''
    ... scene = "Top"
    ... tilt = 0.1  # rad
    ... ''')
    >>> mm.read_scene("my_top.toml") == mm.Top(tilt=0.1)
    True
    """
    try:
        if Path(path).is_fifo():  # it would wait for a writer
            raise OSError(f"{path} is a pipe")
        with Path(path).open(encoding="utf-8-sig") as file:
            text = file.read(LARGEST + 1)
        if len(text) > LARGEST:
            raise InputError("it is too long for a scene")
        if DEEP.search(text):
            raise InputError("it has a key of more than five parts, but fields have one")
        return _scene(text)
    except UnicodeDecodeError:
        raise InputError(f"{path}: it is not TOML: it is not text in UTF-8") from None
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def _scene(text: str) -> Scene:
    try:
        fields = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"it is not TOML: {error}") from None
    if "scene" not in fields:
        names = ", ".join(SCENES)
        raise InputError(f"it must have a key scene, the name of a class: {names}")
    name = fields.pop("scene")
    return scene_with(name, fields, "the file")


@checked
def write_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene as a TOML file with all its fields, each with its unit and meaning.

    Parameters
    ----------
    scene : Scene
    path : str or Path
        The file, which `read_scene` and the option `--scene` of the commands read.

    Raises
    ------
    ValueError
        The path does not end in .toml, or a field is neither a number, text nor None, nor a tuple
        of such.
    OSError
        The file cannot be written.
    """
    if Path(path).suffix.lower() != ".toml":
        raise ArgumentError("path", str(path), "must end in .toml")
    text = toml_of(scene)
    with whole_file(Path(path)) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def toml_of(scene: Scene) -> str:
    """Return a scene as TOML; raises ValueError as `write_scene` does.

    TOML has no null: a field without a value becomes a comment.
    """
    name = type(scene).__name__
    summary = (type(scene).__doc__ or name).partition("\n")[0]
    return "\n".join([f"# {summary}", "", f"scene = {_text(name)}", "", *_lines(scene)]) + "\n"


def _lines(scene: Scene) -> Iterator[str]:
    values = fields_of(scene)
    for field in field_descriptions(scene):
        unit = "" if field.unit in ("", "1") else field.unit
        comment = " ".join(", ".join(filter(None, [unit, field.doc])).split())
        value = values[field.name]
        if value is None:
            yield f"# {field.name}: not given; {comment}"
            continue
        assignment = f"{field.name} = {_toml(value)}"
        yield f"{assignment}  # {comment}" if comment else assignment


def _toml(value: Any) -> str:
    """Return a value as TOML; numbers with the fewest digits that give back the same bits."""
    if isinstance(value, list):
        if not value or not isinstance(value[0], list):
            return f"[{', '.join(map(_toml, value))}]"
        rows = "".join(f"    {_toml(row)},\n" for row in value)
        return f"[\n{rows}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(float(value))  # also of a NumPy number
    return _text(value) if isinstance(value, str) else repr(value)


def _text(value: str) -> str:
    """Return text as a string of TOML, which escapes what JSON does, and DEL."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
