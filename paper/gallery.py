"""The gallery: a page of all figures with their claims, from the files of `scripts/figures.py`.

Its folder contains NAME.png and NAME.json, the claims, for each figure.
"""

import html
import json
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import get_args

from paper.catalog import FIGURES, PAPER_FIGURES, SECTIONS
from paper.figure import Claim, Figure, Verdict

INTRODUCTION = """\
# Gallery

This page reproduces every figure of N. Bou-Rabee and H. Owhadi, *Ballistic transport at uniform
temperature*, and adds figures that test the paper's claims further or answer a builder's questions.
Below each figure are the claims of its caption, or of the text around it, with the measurement and
a verdict. `python scripts/figures.py` makes the whole page, and
`python scripts/figures.py nonconservative_tilted` one figure. The [errata](errata.md) explain what
is wrong in the paper, and why. Each figure names the engine that computed it: MuJoCo, or a
reference integrator, which uses no MuJoCo. If one picture represents two figures of the paper, a
claim of only one of them begins with its number.

Claims that begin with *Ours* are not in the paper. Each claim is judged and counted once: where it
is repeated, a link to the figure that judges it takes the place of the verdict.

{summary}

{thumbnails}

| figure of the paper | counterpart | verdicts on the paper's claims |
|---|---|---|
"""


def save_claims(claims: Iterable[Claim], path: Path) -> None:
    """Write claims as JSON."""
    text = json.dumps([asdict(claim) for claim in claims], indent=1, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


def load_claims(path: Path) -> list[Claim]:
    """Read claims that `save_claims` wrote."""
    saved = json.loads(path.read_text(encoding="utf-8"))
    return [Claim(**fields | {"figures": tuple(fields["figures"])}) for fields in saved]


def tally(claims: Iterable[Claim]) -> str:
    """Return the number of claims with each verdict, as text."""
    counts = Counter(claim.verdict for claim in claims)
    return ", ".join(f"{counts[v]} {v}" for v in get_args(Verdict) if counts[v])


def summary(claims: Iterable[Claim]) -> str:
    """Return the numbers of the paper's claims and of ours that have a verdict, as text."""
    judged = [claim for claim in claims if claim.verdict]
    papers, ours = ([claim for claim in judged if claim.ours == own] for own in (False, True))
    parts = [f"{len(papers)} claim{'s' * (len(papers) != 1)} of the paper: {tally(papers)}"]
    parts += [f"{len(ours)} of ours: {tally(ours)}"] if ours else []
    return f"{'; '.join(parts)}."


def gallery_page(folder: Path) -> str:
    """Return the page, in Markdown, of the figures whose claims are in a folder beside it."""
    claims = {
        name: load_claims(folder / f"{name}.json")
        for name in FIGURES
        if (folder / f"{name}.json").exists()
    }
    all_claims = [claim for found in claims.values() for claim in found]
    beginning = INTRODUCTION.format(
        summary=summary(all_claims), thumbnails="\n".join(_thumbnails(claims, folder.name))
    )
    lines = [beginning + "\n".join(_index(claims))]
    for section, figures in SECTIONS.items():
        shown = [figure for figure in figures if figure.name in claims]
        lines += ["", f"## {section}"] if shown else []
        for figure in shown:
            lines += ["", *_entry(figure, claims[figure.name], folder.name)]
    return "\n".join(lines) + "\n"


def _thumbnails(names: Iterable[str], folder: str) -> Iterator[str]:
    """Yield small pictures that link to their figures; the browser scales the figures' own files.

    The site shows the titles below them.
    """
    yield '<div class="thumbnails">'
    for name in names:
        title = html.escape(FIGURES[name].title)
        picture = f'<img src="{folder}/{name}.png" alt="{title}" width="130" loading="lazy">'
        yield f'<a href="#{name}" title="{title}">{picture}</a>'
    yield "</div>"


def _index(claims: dict[str, list[Claim]]) -> Iterator[str]:
    by_number = {number: figure for figure in FIGURES.values() for number in figure.numbers}
    for number, title in PAPER_FIGURES.items():
        figure = by_number[number]
        if figure.name in claims:
            its_claims = [
                claim
                for claim in claims[figure.name]
                if not claim.ours and (not claim.figures or number in claim.figures)
            ]
            elsewhere = dict.fromkeys(_outcome(c) for c in its_claims if c.repeats)
            verdicts = ", ".join(filter(None, [tally(its_claims), *elsewhere]))
            yield f"| {number}. {title} | [{figure.title}](#{figure.name}) | {verdicts or 'none'} |"


def _outcome(claim: Claim) -> str:
    """Return the verdict, or a link to the figure that has it."""
    if not claim.repeats:
        return f"**{claim.verdict}**"
    return f"see [{FIGURES[claim.repeats].title}](#{claim.repeats})"


def _entry(figure: Figure, claims: list[Claim], folder: str) -> Iterator[str]:
    yield f'<a id="{figure.name}"></a>'
    yield ""
    yield f"### {figure.title}"
    yield ""
    yield f"![{figure.title}]({folder}/{figure.name}.png)"
    yield ""
    yield f"{figure.source} {figure.caption}"
    yield ""
    yield "| claim | measured | verdict |"
    yield "|---|---|---|"
    for claim in claims:
        says, measured = (text.replace("|", "\\|") for text in (claim.says, claim.measured))
        numbered = " and ".join(map(str, claim.figures))
        says = says.replace("Ours:", "*Ours:*")
        says = f"(figure {numbered}) {says}" if claim.figures else says
        yield f"| {says} | {measured} | {_outcome(claim)} |"
