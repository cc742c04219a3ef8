"""Reproduce the paper's figures and check its claims, including the prototype's questions.

Each figure gives `NAME.png` and `NAME.json`, with its claims, in the folder `out`. Without --quick
they are copied to `docs/gallery/`, and the page `docs/gallery.md` is rebuilt.
"""

import shutil
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from absl import logging

import magmotor as mm
from magmotor.commands.output import (
    MISTAKE,
    NO_OPENGL,
    fail,
    run_program,
    warn_in_one_line,
    written_whole,
)
from magmotor.common.checks import check_choice

sys.path.insert(0, str(Path(__file__).parents[1]))  # where the folder paper is
from paper.catalog import FIGURES
from paper.figure import Claim, Figure
from paper.gallery import gallery_page, save_claims, summary

DOCS = Path(__file__).parents[1] / "docs"


@dataclass
class Options:
    names: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """figures to reproduce; by default all"""
    quick: bool = False
    """shorter runs and fewer realizations, which leave many claims undecided; nothing is copied to
    docs/"""
    list: bool = False
    """only list the figures"""
    out: Path = Path("out/figures")
    """folder to write to"""


def main() -> None:
    warn_in_one_line()
    began = time.perf_counter()
    options = tyro.cli(Options, description=__doc__)
    if options.list:
        print(*listing(), sep="\n")
        return
    names = options.names or tuple(FIGURES)
    try:
        for name in names:
            check_choice("names", name, tuple(FIGURES))
    except ValueError as error:
        fail(str(error), MISTAKE)
    logging.set_verbosity(logging.ERROR)  # some runs diverge on purpose
    claims: list[Claim] = []
    undrawn = []
    for number, name in enumerate(names, start=1):
        print(f"== {name} ({number} of {len(names)}): {FIGURES[name].title}", flush=True)
        try:
            claims += make(FIGURES[name], options)
        except mm.render.NoOpenGL as error:
            print(f"not drawn: {error}")
            undrawn.append(name)
    print(f"{summary(claims)} Wall time {time.perf_counter() - began:.0f} s.")
    if undrawn:
        fail(f"not drawn, for lack of OpenGL: {', '.join(undrawn)}", NO_OPENGL)


def listing() -> Iterator[str]:
    for name, figure in FIGURES.items():
        numbers = ", ".join(map(str, figure.numbers))
        yield f"{name:32} {figure.title}" + (f" (paper: {numbers})" if numbers else "")


def make(figure: Figure, options: Options) -> list[Claim]:
    data = figure.compute(options.quick)
    claims = figure.judge(data, options.quick)
    print(*lines(claims), sep="\n", flush=True)
    picture, record = (options.out / f"{figure.name}{suffix}" for suffix in (".png", ".json"))
    with written_whole(picture) as part:
        figure.draw(data, part)
    with written_whole(record) as part:
        save_claims(claims, part)
    print(f"wrote {picture}")
    if not options.quick:
        publish(picture, record)
    return claims


def lines(claims: list[Claim]) -> Iterator[str]:
    for claim in claims:
        yield f"  {claim.verdict or f'see {claim.repeats}'}: {claim.says}"
        yield f"      {claim.measured}"


def publish(*files: Path) -> None:
    """Copy files to the documentation and rebuild its page."""
    gallery = DOCS / "gallery"
    for path in files:
        with written_whole(gallery / path.name) as part:
            shutil.copyfile(path, part)
    with written_whole(gallery.with_suffix(".md")) as part:
        part.write_text(gallery_page(gallery), encoding="utf-8")


if __name__ == "__main__":
    run_program(main)
