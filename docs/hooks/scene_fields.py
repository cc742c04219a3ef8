"""Tables of the fields of scene classes, which the site shows below a class's own description."""

from typing import Any

import griffe

import magmotor as mm
from magmotor.device import Scene
from magmotor.device.quantities import field_descriptions, with_section

PUBLIC = [getattr(mm, name) for name in vars(mm)["__all__"]]
SCENES = {
    f"{scene.__module__}.{scene.__name__}": scene
    for scene in PUBLIC
    if isinstance(scene, type) and issubclass(scene, Scene)
}


class SceneFields(griffe.Extension):
    """Adds the tables to the docstrings as mkdocstrings reads them from the source."""

    def on_class_members(self, *, cls: griffe.Class, **_: Any) -> None:
        """Add the table of a scene class."""
        if (scene := SCENES.get(cls.path)) and cls.docstring:
            cls.docstring.value = with_section(cls.docstring.value, table(scene))


def table(scene: type) -> str:
    """Return a table of the fields of a scene class, as `help` describes them."""
    rows = ["| field | default | unit | meaning |", "|---|---|---|---|"]
    for field in field_descriptions(scene):
        meaning = field.meaning.replace("|", "\\|")
        rows.append(f"| `{field.name}` | `{field.default}` | {field.unit} | {meaning} |")
    return "\n".join(rows)
