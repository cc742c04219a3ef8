"""Replace lines `{fields of NAME}` by tables of the fields of scene classes."""

import re
from typing import Any

import magmotor as mm
from magmotor.device.quantities import field_descriptions

PLACEHOLDER = re.compile(r"^\{fields of (\w+)\}$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Insert the tables of a page."""
    return PLACEHOLDER.sub(lambda match: table(getattr(mm, match[1])), markdown)


def table(scene: type) -> str:
    """Return a table of the fields of a scene class, as `help` describes them."""
    rows = ["| field | default | unit | meaning |", "|---|---|---|---|"]
    for field in field_descriptions(scene):
        doc = field.doc.replace("|", "\\|")
        rows.append(f"| `{field.name}` | `{field.default}` | {field.unit} | {doc} |")
    return "\n".join(rows)
