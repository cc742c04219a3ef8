"""Publish the charts: update tables in documents, and the pictures that they show."""

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from PIL import Image

DOCUMENTS = ("README.md", "docs/methods.md", "docs/advice.md")
COLORS = 128
"""Number of colors of pictures in documents, which keeps them small."""

FRONT = "src/magmotor/run/front.json"
TABLE = re.compile(r"(<!-- charts: (.+?) -->\n).*?(<!-- end of charts -->)", re.DOTALL)
PICTURE = re.compile(r"!\[[^]]*\]\((?:docs/)?([\w-]+\.png)\)")


def publish(
    tables: Mapping[str, str], front: Mapping[str, Any], folder: Path, root: Path
) -> list[Path]:
    """Update the tables in the documents, the pictures that they show, and the front.

    Parameters
    ----------
    tables : mapping
        Markdown by name; each replaces the text of a document between ``<!-- charts: NAME -->`` and
        ``<!-- end of charts -->``.
    front : mapping
        The data of `magmotor.recommend`.
    folder : Path
        Folder of the pictures; those that a document shows are copied to ``docs/``.
    root : Path
        The repository.

    Returns
    -------
    list of Path
        Files that were written.

    Raises
    ------
    ValueError
        A document requests an unknown table.
    """
    written = [root / FRONT]
    texts = {root / name: (root / name).read_text(encoding="utf-8") for name in DOCUMENTS}
    updated = {path: with_tables(text, tables, path.name) for path, text in texts.items()}
    for path, text in updated.items():
        if text != texts[path]:
            path.write_text(text, encoding="utf-8")
            written.append(path)
    drawn = [name for name in pictures(texts.values()) if (folder / name).exists()]
    for name in drawn:
        written.append(root / "docs" / name)
        with Image.open(folder / name) as picture:
            picture.quantize(COLORS).save(written[-1], optimize=True)
    written[0].write_text(compact(front), encoding="utf-8")
    return written


def with_tables(text: str, tables: Mapping[str, str], name: str) -> str:
    """Return a document's text with its tables replaced; `name` is the document's.

    Raises
    ------
    ValueError
        It requests an unknown table.
    """
    missing = {requested for _, requested, _ in TABLE.findall(text)} - tables.keys()
    if missing:
        raise ValueError(
            f"{name} requests the unknown table {missing.pop()}; known are {[*tables]}"
        )
    return TABLE.sub(lambda found: f"{found[1]}\n{tables[found[2]]}\n\n{found[3]}", text)


def pictures(texts: Iterable[str]) -> list[str]:
    """Return the names of the pictures that documents show."""
    return sorted({name for text in texts for name in PICTURE.findall(text)})


def compact(front: Mapping[str, Any]) -> str:
    """Return JSON with a line for each point, so that two fronts can be compared."""
    head = {name: value for name, value in front.items() if name != "points"}
    points = ",\n".join(json.dumps(point) for point in front["points"])
    return f'{json.dumps(head)[:-1]}, "points": [\n{points}\n]}}\n'
