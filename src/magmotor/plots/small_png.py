"""Small pictures: PNG of few colours."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save_small(figure: "Figure", path: str | Path, dpi: int) -> None:
    """Save with few colours, which halves the file; maximum coverage keeps thin lines true."""
    from PIL import Image

    buffer = BytesIO()
    figure.savefig(buffer, dpi=dpi)
    picture = Image.open(buffer).convert("RGB").quantize(128, Image.Quantize.MAXCOVERAGE)
    picture.save(path, "png", optimize=True)
