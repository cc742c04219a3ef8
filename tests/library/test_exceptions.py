"""Errors that a caller can tell apart by type and attributes, without reading sentences."""

import ast
import pickle
from importlib import import_module
from inspect import isclass
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.mjcf import error_numbers, error_raising, error_reports

PACKAGE = Path(mm.__file__).parent

OWN = "ValueError", "Exception"
"""Types of Python that the package does not raise as they are, but as types of its own."""

TWO = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site name="north" pos="0 0 {}" user="{}"/>
    <body name="needle">
      <joint type="hinge"/>
      <geom size="0.01"/>
      <site name="needle" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""


def state(distance=1.0, moment: float | str = 1.0):
    model = mujoco.MjModel.from_xml_string(TWO.format(distance, moment))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_an_argument_says_its_name_its_value_and_what_is_allowed():
    with pytest.raises(mm.ArgumentError) as caught:
        mm.Top(tilt=9.0)
    error = caught.value
    assert (error.argument, error.value) == ("tilt", 9.0)
    assert str(error) == f"tilt = 9.0: {error.allowed}"
    assert error.allowed.startswith("must be")
    assert isinstance(error, ValueError)


def test_a_value_of_a_model_that_cannot_be_pickled_is_sent_as_text():
    with pytest.raises(mm.ArgumentError) as caught:
        mm.Langevin(mm.Top(), kT=1.0)  # type: ignore[arg-type]
    assert isinstance(caught.value.value, mm.Top)
    error = mm.ArgumentError("model", open, "must be a model")
    sent = pickle.loads(pickle.dumps(error))
    assert (sent.argument, sent.value, str(sent)) == ("model", repr(open), str(error))
    values: list[Any] = [1, "text", np.arange(3.0), None]
    for value in values:
        sent = pickle.loads(pickle.dumps(mm.ArgumentError("name", value, "must be other")))
        assert type(sent.value) is type(value)
        assert np.array_equal(sent.value, value)


@pytest.mark.parametrize(
    ("distance", "moment", "kind", "site"),
    [(1.0, "nan", "moment", "north"), (0.0, 1.0, "coincidence", "needle")],
)
def test_a_declaration_says_what_is_wrong_with_which_element(distance, moment, kind, site):
    model, data = state(distance, moment)
    with pytest.raises(mm.DeclarationError) as caught:
        mm.magnetic_energy(model, data)
    error = pickle.loads(pickle.dumps(caught.value))
    assert (error.kind, error.element) == (kind, model.site(site).id)
    assert repr(site) in str(error)


def test_each_error_of_compiled_code_has_its_own_kind():
    assert [getattr(error_numbers, kind.upper()) for kind in error_numbers.KINDS] == [*range(41)]
    assert len(error_numbers.KINDS) == len(error_reports.ELEMENTS)


def test_an_error_of_mujoco_is_no_declaration():
    model, data = state(moment="nan")
    with pytest.raises(mm.DeclarationError):
        mm.magnetic_energy(model, data)
    error = error_raising.declaration_error(mujoco.FatalError("mj_stackAlloc: out of memory"))
    assert (type(error), str(error)) == (mm.InputError, "mj_stackAlloc: out of memory")


def test_every_exception_of_the_package_has_one_base():
    found = {
        cls
        for module in walk_packages([str(PACKAGE)], "magmotor.")
        if ".commands" not in module.name and "__main__" not in module.name
        for cls in vars(import_module(module.name)).values()
        if isclass(cls) and issubclass(cls, Exception) and cls.__module__.startswith("magmotor")
    }
    assert len(found) > 12
    others = {cls.__name__ for cls in found if not issubclass(cls, mm.MagmotorError)}
    assert others == {"OutOfTime"}  # which `advise` catches itself


def test_the_package_raises_types_of_its_own():
    places = [
        f"{path.relative_to(PACKAGE)}:{node.lineno}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in OWN
    ]
    assert places == []
