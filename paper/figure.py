"""A figure: what is computed for it, how it is drawn, and which claims it decides."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paper.claim import Claim


@dataclass(frozen=True)
class Figure:
    """One picture with its claims.

    Parameters
    ----------
    name : str
        Of its file and of the command that makes it.
    title : str
    caption : str
        What is drawn, with the parameters, in Markdown.
    compute : callable
        `compute(quick)` returns the data; `quick` is a reduced size, for tests. Figures that share
        their data share this function, which then is cached.
    claims : callable
        `claims(data)` returns the list of `Claim` that the data decide.
    draw : callable
        `draw(data, path)` writes a PNG of less than 200 kB.
    numbers : tuple of int
        The paper's figures of which this is the counterpart, counted from its first.
    """

    name: str
    title: str
    caption: str
    compute: Callable[[bool], Any]
    claims: Callable[[Any], list[Claim]]
    draw: Callable[[Any, Path], None]
    numbers: tuple[int, ...] = ()
