"""Where a chart was measured, and with what, as its small print."""

from matplotlib.figure import Figure
from store import machine, versions

from magmotor.common import style


def sign(figure: Figure) -> None:
    """Put the small print below a figure."""
    figure.supxlabel(small_print(), fontsize=7, color=style.GREY)


def small_print() -> str:
    found = versions()
    used = ", ".join(f"{name} {found[name]}" for name in ("magmotor", "mujoco", "python"))
    return f"one core of {machine()}; {used}"
