"""A figure and the claims that it decides.

A claim is a statement of a caption, or of the text around it, compared with a measurement.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

Verdict = Literal["right", "in part", "wrong", "not decided"]


@dataclass(frozen=True)
class Claim:
    """A claim, the measurement, and the verdict.

    Parameters
    ----------
    says : str
        The claim, in the paper's words where possible.
    measured : str
        The deciding number, with unit, error and bound.
    verdict : {"right", "in part", "wrong", "not decided"}
        "not decided" if the sample is too small, as for some claims at reduced size.
    figures : tuple of int
        The paper's figures that make the claim, if the picture is the counterpart of others, too.
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
    """Return a claim that is right if a measured condition holds."""
    return Claim(says, measured, "right" if holds else otherwise, figures)


@dataclass(frozen=True)
class Figure:
    """One picture with its claims.

    Parameters
    ----------
    name : str
        Name of its file, and in the command that makes it.
    title : str
    caption : str
        Contents and parameters, in Markdown.
    compute : callable
        `compute(quick)` returns the data; `quick` reduces the size for tests. Figures that share
        data share this function, which is then cached.
    claims : callable
        `claims(data)` returns the list of `Claim` that the data decides.
    draw : callable
        `draw(data, path)` writes a PNG of less than 200 kB.
    numbers : tuple of int
        Numbers of the paper's figures that this one reproduces.
    """

    name: str
    title: str
    caption: str
    compute: Callable[[bool], Any]
    claims: Callable[[Any], list[Claim]]
    draw: Callable[[Any, Path], None]
    numbers: tuple[int, ...] = ()
