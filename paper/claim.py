"""What a caption or the text around it says, held against what is measured."""

from dataclasses import dataclass
from typing import Literal

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
