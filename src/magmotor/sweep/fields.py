"""The numeric fields of a scene, by name; components of vectors have names of their own."""

import dataclasses
from typing import Any, NamedTuple

from magmotor.checks import check_choice, check_number, reject
from magmotor.devices import Scene
from magmotor.scenes.fields import check_value

COMPONENTS = "xyz"


class NumericField(NamedTuple):
    """A number in a scene: a field, or a component of one that is a vector."""

    declared: dataclasses.Field
    component: int | None

    @property
    def attributes(self) -> dict[str, str]:
        """Unit and description, as datasets have them."""
        label = self.declared.metadata["doc"]
        if self.component is not None:
            label += f", {COMPONENTS[self.component]}"
        return {"units": self.declared.metadata["unit"], "long_name": label}

    def checked(self, name: str, value: Any) -> float | int:
        """Return a value as JSON has it; ValueError if it is out of the field's own bounds."""
        if isinstance(self.declared.default, int) and check_number(name, value).is_integer():
            value = int(value)
        return check_value(self.declared, value, name)


def numeric_fields(scene: Scene) -> dict[str, NumericField]:
    """All numbers of a scene by name: `tilt`, and of vectors `position_x`."""
    found = {}
    for field in dataclasses.fields(scene):
        if not field.metadata or field.metadata["choices"] or isinstance(field.default, str):
            continue
        size = field.metadata["size"]
        if size is None:
            found[field.name] = NumericField(field, None)
        else:
            found |= {f"{field.name}_{COMPONENTS[i]}": NumericField(field, i) for i in range(size)}
    return found


def full_name(scene: Scene, name: str) -> str:
    """The name of a numeric field, of which the last words will do where they tell it: `height`.

    Raises
    ------
    ValueError
        There is no such field, or more than one; lists those that there are.
    """
    known = numeric_fields(scene)
    ending = [field for field in known if field.endswith(f"_{name}")]
    if name not in known and len(ending) == 1:
        return ending[0]
    check_choice("field", name, tuple(known))
    return name


def changed(fields: dict[str, Any], known: dict[str, NumericField], changes: dict[str, Any]):
    """Return a scene's fields, as JSON has them, with some numbers replaced."""
    fields = dict(fields)
    for name, value in changes.items():
        field = known[name]
        if field.component is None:
            fields[name] = value
        else:
            vector = list(fields[field.declared.name])
            vector[field.component] = value
            fields[field.declared.name] = vector
    return fields


def check_given(scene: Scene, name: str) -> None:
    """Check that the vector of which a component is to change has a value; else ValueError."""
    field, component = numeric_fields(scene)[name]
    if component is not None and getattr(scene, field.name) is None:
        raise reject(field.name, None, f"given in the scene, for {name} to be varied")
