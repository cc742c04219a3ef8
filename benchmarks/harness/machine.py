"""Where something was measured, and with what."""

import platform
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from magmotor.common import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def machine() -> str:
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def versions() -> dict[str, str]:
    """Versions of what the measurements are of."""
    found = {name: version(name) for name in ("magmotor", "mujoco", "numba", "numpy", "scipy")}
    return {"python": platform.python_version(), **found}


def small_print() -> str:
    """What stands below each picture."""
    found = versions()
    used = ", ".join(f"{name} {found[name]}" for name in ("magmotor", "mujoco", "python"))
    return f"one core of {machine()}; {used}"


def sign(figure: "Figure") -> None:
    """Put the small print below a figure."""
    figure.supxlabel(small_print(), fontsize=7, color=style.GRAY)
