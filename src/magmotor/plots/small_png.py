"""Small pictures: PNG of few colours."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save_small(figure: "Figure", path: str | Path, dpi: int, *, shaded: bool = False) -> None:
    """Save with few colours, which halves the file.

    Maximum coverage keeps the colours of thin lines; median cut, for pictures with shaded areas,
    those of the areas.
    """
    from PIL import Image

    buffer = BytesIO()
    figure.savefig(buffer, dpi=dpi)
    picture = Image.open(buffer).convert("RGB")
    if shaded:
        few = picture.quantize(128, Image.Quantize.MEDIANCUT, kmeans=3)
    else:
        few = picture.quantize(128, Image.Quantize.MAXCOVERAGE)
    few.save(path, "png", optimize=True)
