"""The layouts of MuJoCo's structs in the versions for which the library has a table.

    python -m library.layouts                # adds the version that is installed
    python -m library.layouts 3.16.0 3.17.0  # adds these, each from a temporary folder

Without Python, a program takes the offsets from `layouts.json`, which has a row for each version.
Rows of other fields than those of `magmotor.mjcf.layout` are dropped.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import magmotor  # noqa: F401  # isort: skip  before MuJoCo, for which it chooses an OpenGL library
import mujoco

from magmotor.mjcf import layout

PATH = Path(__file__).with_suffix(".json")


class Version(NamedTuple):
    """A version of MuJoCo: the number that it has in C, and the offsets of the fields."""

    number: int
    offsets: list[int]


def known() -> dict[str, Version]:
    """Return the versions with the current fields, oldest first."""
    content = json.loads(PATH.read_text(encoding="utf-8")) if PATH.exists() else {}
    if content.get("fields") != [*layout.Layout._fields]:
        return {}
    return {name: Version(*row) for name, row in content["versions"].items()}


def running() -> Version:
    """Return the version that is installed."""
    return Version(mujoco.mj_version(), [*layout.current()])


def main(versions: list[str]) -> None:
    """Add versions, by default the one that is installed."""
    if not versions:
        write(known() | {mujoco.mj_versionString(): running()})
    for version in versions:
        with tempfile.TemporaryDirectory() as folder:
            install = "-m", "pip", "install", "--quiet", "--no-deps", "--target", folder
            subprocess.run([sys.executable, *install, f"mujoco=={version}"], check=True)
            paths = os.pathsep.join([folder, *filter(None, sys.path)])
            subprocess.run(
                [sys.executable, "-m", "library.layouts"],
                env=os.environ | {"PYTHONPATH": paths},
                check=True,
            )


def write(versions: dict[str, Version]) -> None:
    """Write the file, with a line for each version."""
    rows = sorted(versions.items(), key=lambda row: row[1].number)
    lines = ",\n".join(f'  "{name}": {json.dumps(version)}' for name, version in rows)
    fields = json.dumps(layout.Layout._fields)
    text = f'{{"fields": {fields},\n"versions": {{\n{lines}\n}}}}\n'
    PATH.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
