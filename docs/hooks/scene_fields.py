"""Tables of the scenes' fields, in place of lines `{fields of NAME}`."""

import dataclasses
import re
from typing import Any

import magmotor as mm

PLACE = re.compile(r"^\{fields of (\w+)\}$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Write the tables of a page."""
    return PLACE.sub(lambda found: table(getattr(mm, found[1])), markdown)


def table(scene: type) -> str:
    """Name, default, unit and meaning of each field that a scene declares as a quantity."""
    rows = ["| field | default | unit | meaning |", "|---|---|---|---|"]
    for field in dataclasses.fields(scene):
        if told := field.metadata:
            doc, unit = (str(told[key]).replace("|", "\\|") for key in ("doc", "unit"))
            rows.append(f"| `{field.name}` | `{shown(field.default)}` | {unit} | {doc} |")
    return "\n".join(rows)


def shown(value: Any) -> str:
    """A default, of numbers no more digits than tell them."""
    return f"{value:.6g}" if isinstance(value, float) else repr(value)
