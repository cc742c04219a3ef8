"""The machine and the versions of a measurement."""

import platform
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from magmotor.common import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def machine() -> str:
    """Return the name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def versions() -> dict[str, str]:
    """Return the versions of the packages that are measured."""
    found = {name: version(name) for name in ("magmotor", "mujoco", "numba", "numpy", "scipy")}
    return {"python": platform.python_version(), **found}


def small_print() -> str:
    """Return the text below each picture."""
    found = versions()
    used = ", ".join(f"{name} {found[name]}" for name in ("magmotor", "mujoco", "python"))
    return f"one core of {machine()}; {used}"


def sign(figure: "Figure") -> None:
    """Write the small print below a figure."""
    figure.supxlabel(small_print(), fontsize=7, color=style.GRAY)
