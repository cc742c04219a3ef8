"""The common style of all figures, with colors that color-blind readers can distinguish."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from magmotor.common.optional import extra

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.ImageFont import FreeTypeFont


BLUE, ORANGE, GREEN, INK, GRAY = "#0072b2", "#e69f00", "#009e73", "#22282e", "#8a9299"
"""Colors of simulations, theory, a third kind of data, text, and the background."""

PURPLE = "#cc79a7"
"""Color of a fourth kind of data."""

SCHEMES = {
    "euler": (BLUE, "o"),
    "implicitfast": ("#56b4e9", "v"),
    "implicit": ("#999933", ">"),
    "discrete": ("#661100", "d"),
    "rk4": (ORANGE, "^"),
    "baoab": (GREEN, "D"),
    "verlet": ("#d55e00", "P"),
    "cayley": ("#332288", "s"),
    "middle": ("#117733", "p"),
    "blanes-moan4": (PURPLE, "X"),
    "blanes-moan6": ("#882255", "h"),
    "dop853": (INK, "*"),
}
"""Color and marker of each scheme of integration, the same in all figures."""

LANDSCAPE = ("#7f8d9b", "#f8f9fa")
"""Colors of the lowest and the highest potential, pale so that paths stand out."""

NO_SPIN = 1e-3
"""Spin (rad/s) below which zero is drawn, so that rounding errors do not fill the axes."""

FONT = "DejaVu Sans"

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
"""A translation of digits into superscripts."""

DPI = 120
"""Dots per inch of a picture, unless told otherwise."""

STYLE: dict[Any, Any] = {
    "figure.facecolor": "white",
    "font.family": FONT,
    "font.size": 10,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": GRAY,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.linewidth": 0.8,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-3, 4),
    "axes.grid": True,
    "grid.color": "#e4e7ea",
    "grid.linewidth": 0.8,
    "xtick.color": INK,
    "ytick.color": INK,
    "lines.linewidth": 1.6,
    "legend.framealpha": 0.8,
    "legend.edgecolor": "none",
    "legend.fontsize": 9,
    "pdf.fonttype": 42,  # TrueType, so that the text can be searched and edited
    "axes.prop_cycle": f"cycler('color', {[BLUE, ORANGE, GREEN, PURPLE, INK, GRAY]})",
}
"""Matplotlib's settings of all figures: `rcParams.update(STYLE)` gives yours the same look."""


def check_matplotlib() -> None:
    """Raise MissingExtra if matplotlib is not installed, before a long run rather than after it."""
    with extra("movies"):
        import matplotlib  # noqa: F401


@contextmanager
def figure(width: float, height: float) -> Iterator["Figure"]:
    """Create a figure in this style, without pyplot; width and height are in inches."""
    with extra("movies"):
        import matplotlib
        from matplotlib.figure import Figure
        from matplotlib.layout_engine import ConstrainedLayoutEngine

    with matplotlib.rc_context(STYLE):
        layout = ConstrainedLayoutEngine(w_pad=0.1, h_pad=0.1)
        yield Figure(figsize=(width, height), layout=layout, dpi=100)


def method_look(method: str) -> dict[str, Any]:
    """Return the color and marker of a method `engine/scheme`; those of MuJoCo are filled."""
    engine, _, scheme = method.partition("/")
    color, marker = SCHEMES.get(scheme, (GRAY, "x"))
    return {"color": color, "marker": marker, "mfc": color if engine == "mujoco" else "white"}


@cache
def pillow_font(size: int) -> "FreeTypeFont":
    """Return the figures' font, which Matplotlib ships, for Pillow; `size` is in pixels."""
    with extra("movies"):
        import matplotlib
        from PIL import ImageFont

    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    return ImageFont.truetype(str(fonts / f"{FONT.replace(' ', '')}.ttf"), size)


def save(figure: "Figure", path: str | Path, dpi: int = DPI, *, shaded: bool = False) -> None:
    """Write a figure to a file, whose suffix sets the format.

    A .png has few colors, which halves its size. Maximum coverage preserves the colors of thin
    lines; median cut, for figures with shaded areas, preserves the colors of the areas.

    Parameters
    ----------
    figure : Figure
    path : str or Path
        The file.
    dpi : int
        Dots per inch; in PDF and SVG they apply only to the parts that are images.
    shaded : bool
        Whether the figure has shaded areas.
    """
    if Path(path).suffix.lower() != ".png":
        figure.savefig(path, dpi=dpi)
        return
    from PIL import Image

    buffer = BytesIO()
    figure.savefig(buffer, dpi=dpi, pil_kwargs={"compress_level": 0})
    picture = Image.open(buffer).convert("RGB")
    if shaded:
        few = picture.quantize(128, Image.Quantize.MEDIANCUT, kmeans=3)
    else:
        few = picture.quantize(128, Image.Quantize.MAXCOVERAGE)
    few.save(path, "png", optimize=True, dpi=(dpi, dpi))
