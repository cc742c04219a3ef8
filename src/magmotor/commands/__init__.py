"""The command `magmotor`: each of its commands is a module of this package."""

import gc
import sys
from functools import partial
from importlib import import_module
from typing import Any

from magmotor import __version__
from magmotor.commands.output import MISTAKE, fail, is_help_asked, run_program
from magmotor.common.checks import did_you_mean
from magmotor.common.optional import require

COMMANDS = {
    "movie": "render a video of the spinning top, or of a flight of the motor",
    "view": "watch a scene or any MJCF file live; pull, tilt, heat or brake it",
    "sweep": "run a scene for every combination of parameters, resumably",
    "rerun": "run a dataset again and check that the result is identical",
    "export": "write a scene as MJCF or TOML, or a dataset as a table",
    "describe": "list what in an MJCF file is magnetic, and what has a temperature",
    "check": "find what will fail in a magnetic model, and settings that work",
    "advise": "find the cheapest integrator and timestep for a given error",
    "examples": "list, show and run the example programs",
    "library": "print the path of the library of compiled functions",
    "completion": "print a script with which bash or zsh completes commands and flags",
}
"""Name and purpose of each command; its module has a function `main` without arguments."""

EXTRAS = {
    "movie": "movies",
    "sweep": "sweep",
    "rerun": "scenes",
}
"""The extra that a command always needs."""


def main(name: str | None = None) -> None:
    """Run a command with the arguments of the program.

    Parameters
    ----------
    name : str, optional
        One of `COMMANDS`; by default, the first argument is the name.
    """
    run_program(partial(_run, name))


def _run(name: str | None) -> None:
    arguments = sys.argv[1:]
    if name is None:
        sys.argv[:1] = ["magmotor"]
        name, arguments = _chosen(arguments)
    sys.argv = [f"magmotor {name}", *arguments]
    if name in EXTRAS and not is_help_asked():
        require(EXTRAS[name])
    try:
        command = _imported(f"{__name__}.{name}")
    except (ImportError, RuntimeError) as reason:  # of the environment, such as a wrong MUJOCO_GL
        fail(str(reason), MISTAKE)
    command.main()


def _imported(module: str) -> Any:
    """Import a module without looking for garbage meanwhile, or later in what stays anyway."""
    if module not in sys.modules:
        enabled = gc.isenabled()
        gc.disable()  # a fifth of the time
        try:
            import_module(module)
        finally:
            gc.freeze()
            if enabled:
                gc.enable()
    return sys.modules[module]


def _chosen(arguments: list[str]) -> tuple[str, list[str]]:
    """Return the command's name and its arguments, or print what was asked for and end."""
    first = arguments[0] if arguments else "--help"
    if first in ("-h", "--help"):
        print(usage())
        raise SystemExit(0 if arguments else MISTAKE)
    if first == "--version":
        print(f"magmotor {__version__}")
        raise SystemExit(0)
    if first not in COMMANDS:
        meant = did_you_mean(first, COMMANDS)
        known = ", ".join(COMMANDS)
        fail(f"{first!r} is not a command{meant}; the commands are {known}", MISTAKE)
    return first, arguments[1:]


def usage() -> str:
    """Return the help text of `magmotor`."""
    rows = "\n".join(f"  {name:10} {purpose}" for name, purpose in COMMANDS.items())
    return f"""\
usage: magmotor [-h] [--version] COMMAND ...

Magnetism and temperature for MuJoCo.

commands:
{rows}

`magmotor COMMAND --help` describes the options of a command."""
