"""A figure, and the claims of the paper that it decides.

A claim is what a caption or the text around it says, held against what is measured.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

Verdict = Literal["right", "in part", "wrong", "not decided"]


@dataclass(frozen=True)
class Claim:
    """A claim, what was measured, and whether that bears it out.

    Parameters
    ----------
    says : str
        The claim, in the paper's words as far as possible.
    measured : str
        The number that decides, with unit, error and bound.
    verdict : {"right", "in part", "wrong", "not decided"}
        The last where the sample is too small, as of some claims at reduced size.
    figures : tuple of int
        The paper's figures of which it is said, where the picture has others, too.
    """

    says: str
    measured: str
    verdict: Verdict
    figures: tuple[int, ...] = ()


def judged(
    says: str,
    measured: str,
    holds: bool,
    otherwise: Verdict = "wrong",
    figures: tuple[int, ...] = (),
) -> Claim:
    """A claim that is right where a measured condition holds."""
    return Claim(says, measured, "right" if holds else otherwise, figures)


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
