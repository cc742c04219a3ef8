"""A figure and the claims that it decides.

A claim is a statement of a caption, or of the text around it, compared with a measurement.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

Verdict = Literal["right", "in part", "wrong", "not decided"]

ENGINES = {
    "mujoco": "MuJoCo",
    "variational": "the reference integrators",
    "scipy": "SciPy's solver",
}


OURS = "Ours: "
"""How a claim begins that the paper does not make."""


@dataclass(frozen=True)
class Claim:
    """A claim, the measurement, and the verdict.

    Parameters
    ----------
    says : str
        The claim, in the paper's words where possible; it begins with `OURS` if the paper does not
        make it.
    measured : str
        The deciding number, with unit, error and bound.
    verdict : {"right", "in part", "wrong", "not decided"} or None
        "not decided" if the sample is too small, as for many claims at reduced size. None if
        another figure judges the same claim.
    figures : tuple of int
        The paper's figures that make the claim, if the picture is the counterpart of others, too.
    repeats : str
        Name of the figure that judges the same claim, so that each claim is counted once.

    Raises
    ------
    ValueError
        The claim has both a verdict and a figure that it repeats, or neither.
    """

    says: str
    measured: str
    verdict: Verdict | None
    figures: tuple[int, ...] = ()
    repeats: str = ""

    def __post_init__(self) -> None:
        """Check that the claim is judged once."""
        if (self.verdict is None) != bool(self.repeats):
            raise ValueError(
                f"claim {self.says!r} has verdict = {self.verdict!r} and repeats ="
                f" {self.repeats!r}: it must have one of them"
            )

    @property
    def ours(self) -> bool:
        """Whether the paper does not make the claim."""
        return self.says.startswith(OURS)


def judged(
    says: str,
    measured: str,
    holds: bool,
    otherwise: Verdict = "wrong",
    figures: tuple[int, ...] = (),
) -> Claim:
    """Return a claim that is right if a measured condition holds."""
    return Claim(says, measured, "right" if holds else otherwise, figures)


def repeated(says: str, measured: str, figure: str, figures: tuple[int, ...] = ()) -> Claim:
    """Return a claim that the figure of that name judges; here it is only measured again."""
    return Claim(says, measured, None, figures, figure)


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
    methods : tuple of str
        The methods `engine/scheme` of all runs, as in the attributes of their datasets.
    undecided : tuple of int
        Which claims, counted from 0, need the statistics of the full size.
    """

    name: str
    title: str
    caption: str
    compute: Callable[[bool], Any]
    claims: Callable[[Any], list[Claim]]
    draw: Callable[[Any, Path], None]
    numbers: tuple[int, ...] = ()
    methods: tuple[str, ...] = ()
    undecided: tuple[int, ...] = ()

    def judge(self, data: Any, quick: bool) -> list[Claim]:
        """Return the claims; at reduced size, those that need the full one are not decided."""
        found = self.claims(data)
        assert all(k < len(found) for k in self.undecided), self.name
        return [
            replace(claim, verdict="not decided") if quick and k in self.undecided else claim
            for k, claim in enumerate(found)
        ]

    @property
    def source(self) -> str:
        """The paper's figures, and the engines that compute this one, in Markdown."""
        plural = "s" if len(self.numbers) > 1 else ""
        shown = f"Figure{plural} {' and '.join(map(str, self.numbers))} of the paper, computed"
        used = [
            f"{title} ({' and '.join(f'`{method}`' for method in found)})"
            for engine, title in ENGINES.items()
            if (found := [name for name in self.methods if name.startswith(f"{engine}/")])
        ]
        engines = f"by {' and '.join(used)}" if used else "without a run"
        return f"*{shown if self.numbers else 'Computed'} {engines}.*"
