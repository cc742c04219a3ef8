"""All arguments and fields accept NumPy's numbers like Python's."""

import dataclasses
import json
from typing import Any

import numpy as np
import pytest

import magmotor as mm

RUN: dict[str, Any] = {
    "method": "variational/baoab", "timestep": 0.03125, "duration": 8.0, "seed": 3, "replicas": 100,
    "record_interval": 2,
}  # fmt: skip
MANY: dict[str, Any] = {
    "method": "variational/baoab", "timestep": 0.03125, "duration": 60.0, "seed": 3,
    "replicas": 100, "sample_interval": 10, "burn_in": 2.0, "trajectories": 2, "threads": 1,
}  # fmt: skip


def _narrow(value: float) -> Any:
    """The same number in NumPy's smallest type, which overflows when multiplied."""
    return np.int8(value) if isinstance(value, int) else np.float32(value)


@pytest.mark.parametrize("name", [name for name in RUN if name != "method"])
def test_arguments_of_simulate(name, tmp_path):
    expected = mm.simulate(mm.Disk(), **RUN)
    numpys = RUN | {name: _narrow(RUN[name])}
    run = mm.simulate(mm.Disk(), **numpys, checkpoint=tmp_path / "checkpoint.checkpoint")
    assert run.identical(expected)
    assert type(run.attrs[name]) is type(RUN[name])


@pytest.mark.parametrize("name", [name for name in MANY if name != "method"])
def test_arguments_of_ensembles(name, tmp_path):
    expected = mm.ensemble(mm.Disk(), **MANY)
    numpys = MANY | {name: _narrow(MANY[name])}
    many = mm.ensemble(mm.Disk(), **numpys, checkpoint=tmp_path / "checkpoint.checkpoint")
    assert many.identical(expected)


def test_the_path_and_its_views():
    path = mm.noise.BrownianPath(_narrow(3), _narrow(0.03125), factor=_narrow(64))
    assert path == mm.noise.BrownianPath(3, 0.03125, factor=64)
    assert path.coarsened(_narrow(4)).factor == 256
    mm.simulate(mm.Disk(), method="variational/baoab", duration=8.0, path=path)


@pytest.mark.parametrize("scene", [mm.Top.experiment(), mm.Motor(), mm.Disk(potential=((1, 2),))])
def test_fields_of_scenes(scene):
    fields = {field.name: getattr(scene, field.name) for field in dataclasses.fields(scene)}
    numpys = type(scene)(**{name: _as_numpys(value) for name, value in fields.items()})
    assert numpys == scene
    assert json.dumps(dataclasses.asdict(numpys)) == json.dumps(dataclasses.asdict(scene))


def _as_numpys(value):
    if isinstance(value, tuple):
        return tuple(_as_numpys(part) for part in value)
    kinds = {int: np.int8, float: np.float64}
    return kinds[type(value)](value) if type(value) in kinds else value
