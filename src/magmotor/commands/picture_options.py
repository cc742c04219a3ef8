"""The options of all commands that draw pictures."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from magmotor.commands.output import written_whole
from magmotor.common import style
from magmotor.common.arguments import check_of
from magmotor.common.hints import Dpi


@dataclass(kw_only=True)
class PictureOptions:
    pictures: Literal["png", "pdf", "svg"] = "png"
    """format of the pictures"""
    dpi: int = style.DPI
    """dots per inch of the pictures"""

    def check_pictures(self) -> None:
        """Check what would otherwise fail only after the run."""
        check_dpi = check_of(Dpi)
        assert check_dpi
        check_dpi("dpi", self.dpi)

    def draw(self, stem: Path, draw: Callable[..., None]) -> Path:
        """Write a picture with `draw(path, dpi=...)` and return its path, `stem` with a suffix."""
        path = stem.with_name(f"{stem.name}.{self.pictures}")
        with written_whole(path) as part:
            draw(part, dpi=self.dpi)
        return path
