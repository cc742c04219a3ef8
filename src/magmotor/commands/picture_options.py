"""The options of all commands that draw pictures."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from magmotor.commands.output import written_whole
from magmotor.common import style
from magmotor.common.arguments import check_of
from magmotor.common.hints import Dpi


def check_as(hint: Any, name: str, value: Any) -> None:
    """Check a value as that of an argument with a type hint of `magmotor.common.hints`."""
    check = check_of(hint)
    assert check
    check(name, value)


@dataclass(kw_only=True)
class PictureOptions:
    pictures: Literal["png", "pdf", "svg"] = "png"
    """format of the pictures"""
    dpi: int = style.DPI
    """dots per inch of the pictures"""

    def check_pictures(self) -> None:
        """Check what would otherwise fail only after the run."""
        check_as(Dpi, "dpi", self.dpi)

    def draw(self, stem: Path, draw: Callable[..., None]) -> Path:
        """Write a picture with `draw(path, dpi=...)` and return its path, `stem` with a suffix."""
        path = stem.with_name(f"{stem.name}.{self.pictures}")
        with written_whole(path) as part:
            draw(part, dpi=self.dpi)
        return path
