"""Shared by the examples: the command line, and saving pictures."""

import sys
from collections.abc import Callable
from pathlib import Path

import tyro
from matplotlib.figure import Figure


def run(main: Callable[..., None]) -> None:
    """Run `main` with its parameters as flags; errors and Ctrl-C end it with one line."""
    name = Path(sys.argv[0]).name
    try:
        tyro.cli(main, description=sys.modules[main.__module__].__doc__)
    except KeyboardInterrupt:
        print(f"{name}: interrupted, nothing written", file=sys.stderr)
        raise SystemExit(130) from None
    except (ImportError, OSError, ValueError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        raise SystemExit(2) from None


def save(figure: Figure, path: Path) -> None:
    """Write a picture, as .png if its name has no suffix."""
    path = path if path.suffix else path.with_name(f"{path.name}.png")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)
    print(f"wrote {path}")
