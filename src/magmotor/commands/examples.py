"""List the example programs, print one, run one, or copy all to a folder.

`magmotor examples list` says what there is, `magmotor examples show NAME` prints a program and
names the folder of its models, and `magmotor examples run NAME` runs it; flags after the name are
the program's own, as in `magmotor examples run pick_and_place --help`. `magmotor examples copy
FOLDER` copies the programs and their models to a new folder, where you can change them and run them
by `python NAME.py`.
"""

import ast
import runpy
import shutil
import sys
from pathlib import Path

from magmotor.commands.output import MISTAKE, fail, write_verbatim
from magmotor.common.checks import check_choice
from magmotor.common.environment import data_folder
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.optional import extra

VERBS = {"list": 0, "show": 1, "run": sys.maxsize, "copy": 1}
"""Verbs, with the largest number of their arguments."""


def main() -> None:
    """Obey the verb."""
    arguments = sys.argv[1:]
    if not arguments or arguments[0] in ("-h", "--help"):
        usage = f"usage: {sys.argv[0]} list | show NAME | run NAME [FLAGS] | copy FOLDER"
        print(f"{usage}\n\n{__doc__}".rstrip())
        raise SystemExit(0 if arguments else MISTAKE)
    found = programs()
    verb, *rest = arguments
    try:
        check_choice("verb", verb, tuple(VERBS))
        if surplus := rest[VERBS[verb] :]:
            raise InputError(f"{verb} takes no argument {surplus[0]!r}")
        if verb == "list":
            print(*(f"{name:20} {purpose(path)}" for name, path in found.items()), sep="\n")
            return
        if verb == "copy":
            copy(*rest)
            return
        name = rest[0] if rest else ""
        check_choice("name", name, tuple(found))
    except ValueError as error:
        fail(str(error), MISTAKE)
    if verb == "show":
        write_verbatim(found[name].read_text(encoding="utf-8") + "\n")
        print(f"# its models are in {found[name].parent}")
        return
    sys.argv = [f"magmotor examples run {name}", *rest[1:]]
    sys.path.insert(0, str(found[name].parent))  # where the examples' module support is
    with extra("movies"):
        runpy.run_path(str(found[name]), run_name="__main__")


def copy(name: str = "") -> None:
    """Copy the programs and their models to a new folder."""
    folder = Path(name)
    if not name or folder.exists():
        raise ArgumentError("folder", name, "must be the path of a new folder")
    shutil.copytree(
        data_folder("examples"), folder, ignore=shutil.ignore_patterns("__pycache__", "c")
    )
    print(f"copied the examples to {folder}")


def programs() -> dict[str, Path]:
    """Return the programs by name."""
    found = {path.stem: path for path in sorted(data_folder("examples").glob("*.py"))}
    del found["support"]
    return found


def purpose(path: Path) -> str:
    """Return the first sentence of a program's docstring."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return text.partition("\n\n")[0].replace("\n", " ")
