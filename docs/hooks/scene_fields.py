"""Replace lines `{fields of NAME}` by tables of the fields of scene classes."""

import dataclasses
import re
from typing import Any

import magmotor as mm

PLACEHOLDER = re.compile(r"^\{fields of (\w+)\}$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Insert the tables of a page."""
    return PLACEHOLDER.sub(lambda match: table(getattr(mm, match[1])), markdown)


def table(scene: type) -> str:
    """Return a table of name, default, unit and meaning of each field made by `quantity`."""
    rows = ["| field | default | unit | meaning |", "|---|---|---|---|"]
    for field in dataclasses.fields(scene):
        if metadata := field.metadata:
            doc, unit = (str(metadata[key]).replace("|", "\\|") for key in ("doc", "unit"))
            rows.append(f"| `{field.name}` | `{shown(field.default)}` | {unit} | {doc} |")
    return "\n".join(rows)


def shown(value: Any) -> str:
    """Return a default as text, numbers to six digits."""
    return f"{value:.6g}" if isinstance(value, float) else repr(value)
