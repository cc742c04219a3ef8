"""Datasets with damaged attributes: readers name the attribute, or read it correctly."""

import json
import re
from types import FunctionType
from typing import Any

import numpy as np
import pytest
from refusals import refused

import magmotor as mm
from magmotor.noise import BrownianPath, path_of

NUMBERS = {"method": "variational/baoab", "timestep": 0.05}

ANYTHING = [
    None, "", "x", "[", "[]", "{}", "null", "[" * 10**5, b"x", [], [1, 2], {}, np.array([1.0, 2.0]),
    np.array(["a"]), np.nan, np.inf, -1, 0, 1e300, 10**400, True, 1j, np.str_("y"), float,
]  # fmt: skip


@pytest.fixture(scope="module")
def run():
    path = BrownianPath(3, 0.1).refined()
    given = {"v": [0.1, 0.2]}
    return mm.simulate(mm.Disk(), duration=1.0, replicas=2, initial=given, path=path, **NUMBERS)


@pytest.fixture(scope="module")
def many():
    return mm.ensemble(mm.Disk(), duration=10.0, replicas=4, burn_in=1.0, **NUMBERS)


def fields(name, **changes):
    """Return a JSON object of an attribute with some fields changed, or removed if `...`."""

    def change(attributes):
        told = {**json.loads(attributes[name]), **changes}
        return json.dumps({k: v for k, v in told.items() if v is not ...})

    return change


SINGLE = {
    "scene": [],
    "scene_fields": [
        fields("scene_fields", sigma=...),
        fields("scene_fields", wind=1.0),
        *[
            fields("scene_fields", **{name: value})
            for name in ("sigma", "potential", "x", "surface")
            for value in (None, {}, "x", float("nan"), 1e400, [[1]], True)
        ],
    ],
    "method": ["variational/nothing", "mujoco", "scipy/dop853"],
    "timestep": [1e-320, 1e-12, 1e9, "0.05"],
    "duration": [1e-12, 1e17, "1.0"],
    "record_interval": [1.0, 10**9, 2**63, 2**53, "1"],
    "seed": [2**53, 1.5, "3", 2**64],
    "replicas": ["2", 2.0, 3, 2**60],
    "path": [
        fields("path", seed=...),
        fields("path", seed=None),
        fields("path", more=1),
        fields("path", timestep="0.1"),
        fields("path", timestep=float("nan")),
        fields("path", level=2**63),
        fields("path", level=40),
        fields("path", level=0, factor=2**53),
        fields("path", level=0, factor=10**300),
        fields("path", factor=2),
    ],
}  # fmt: skip

OF_THE_DISK = "sigma|potential|x|surface"

MANY = {
    "sample_interval": [2**63, 1.5, 10**9],
    "burn_in": ["1", 1e17, 9.9],
    "trajectories": [5, 2**63, 1.5],
    "duration": [0.01, 1e17],
    "timestep": [5e-324, 1e9],
}


def not_told(read, run, table, message):
    """Return the damaged attributes for which `read` raises no ValueError with the message."""
    missed = []
    for name, own in table.items():
        for value in [*own, *ANYTHING]:
            told = value(run.attrs) if isinstance(value, FunctionType) else value
            try:
                read(run.assign_attrs({name: told}))
                missed.append(f"{name}: {told!r:.80} is taken")
            except ValueError as error:
                if not re.search(message, str(error)):
                    missed.append(f"{name}: {told!r:.80} ends in {error!s:.80}")
    return missed


def test_rerun_names_the_attribute(run):
    message = rf"^({'|'.join(SINGLE)}|attributes|a field|level|factor|replica|time|{OF_THE_DISK})\b"
    missed = not_told(mm.rerun, run, SINGLE, message)
    assert missed == ["seed: 0 is taken"]


def test_rerun_of_an_ensemble_names_the_attribute(many):
    missed = not_told(mm.rerun, many, MANY, rf"^({'|'.join(MANY)}|time)\b")
    assert missed == ["burn_in: 0 is taken", "trajectories: 0 is taken"]


def test_scene_of_names_the_attribute(run):
    table = {name: SINGLE[name] for name in ("scene", "scene_fields")}
    message = rf"^(scene|attributes|a field|{OF_THE_DISK})\b"
    assert not_told(mm.scene_of, run, table, message) == []
    for name in table:
        bare = run.assign_attrs()
        del bare.attrs[name]
        with pytest.raises(mm.InputError, match=name):
            mm.scene_of(bare)


def test_path_of_names_the_attribute(run):
    read = lambda run: path_of(run.attrs)  # noqa: E731
    table = {"path": SINGLE["path"]}
    assert not_told(read, run, table, r"^(attributes|a field|seed|timestep|level|factor)\b") == []
    told = {"seed": 3, "timestep": 0.1}
    assert path_of(told) == BrownianPath(**told)
    for name in told:
        for value in (None, "3", "x", -1, np.nan, [], {}):
            with refused(name):
                path_of(told | {name: value})
        with refused(name):
            path_of({k: v for k, v in told.items() if k != name})


@pytest.mark.parametrize("value", ["x", -1, 1.5, [], 2**53, 10**30])
def test_a_continued_run_names_an_invalid_first_step(run, value):
    before = run.drop_vars("step").assign_attrs(first_step=value)
    path = path_of(run.attrs)
    with pytest.raises(mm.ArgumentError) as told:
        mm.simulate(mm.Disk(), initial=before, path=path, replicas=2, duration=1.0, **NUMBERS)
    assert told.value.argument in ("attributes['first_step']", "duration")


NO_RUNS = [
    lambda run: run.drop_vars("x"),
    lambda run: run.isel(time=0),
    lambda run: run.isel(time=slice(0)),
    lambda run: run.isel(replica=[0]),
    lambda run: run.drop_vars("time"),
    lambda run: run.drop_vars("step").assign_coords(time=run.time.values * np.nan),
    lambda run: run.drop_vars("step").assign_coords(time=-run.time.values),
    lambda run: run.assign_coords(step=-run.step - 1),
    lambda run: run.drop_vars("step").assign_coords(time=run.time.values.astype(str)),
    lambda run: run.assign(x=run.x * np.nan),
    lambda run: run.assign(v=run.v * 1e300),
    lambda run: run.astype("c16"),
    lambda run: run.astype(str),
    lambda run: run.astype(bool),
    lambda run: run.expand_dims(seed=2),
    lambda run: run.rename(x="y"),
]


def test_initial_datasets_that_are_not_runs_are_refused(run):
    path = path_of(run.attrs)
    numerics = {"replicas": 2, "duration": 10.0, **NUMBERS}
    for change in NO_RUNS:
        with pytest.raises(mm.InputError, match=r"^(number of records in )?initial"):
            mm.simulate(mm.Disk(), initial=change(run), path=path, **numerics)


ORBITS = {mm.Disk(): ("x", "theta"), mm.Motor(): ("position", "axis"), mm.Top(): ("velocity",)}
WRONG = [
    "x", b"1", 1j, None, {}, [], [[1.0], [1.0, 2.0]], [None] * 3, ["1", "2", "3"],
    np.zeros((2, 2, 2)), np.nan, [np.inf] * 3, [1e60] * 3, 10**400, True, [True] * 3, float,
    np.array("2026", "M8[s]"),
]  # fmt: skip


@pytest.mark.parametrize("scene", ORBITS, ids=lambda scene: type(scene).__name__)
def test_initial_parts_that_are_not_numbers_are_refused(scene):
    replicas = None if isinstance(scene, mm.Top) else 3
    for name in ORBITS[scene]:
        for value in WRONG:
            with pytest.raises(mm.InputError, match=rf"^initial\['{name}'\] (=|contains) "):
                mm.simulate(scene, initial={name: value}, duration=1, replicas=replicas, **NUMBERS)
    wrong: Any = (7, "x", [1.0], np.zeros(3), {3: 1.0}, {"wind": 1.0}, {None: 1})
    for initial in wrong:
        with refused("initial"):
            mm.simulate(scene, initial=initial, duration=1, replicas=replicas, **NUMBERS)


def test_ensembles_refuse_initial_parts_that_are_not_numbers():
    wrong: Any = [{"x": value} for value in WRONG] + [7, "x", {"wind": 1.0}]
    for initial in wrong:
        with pytest.raises(mm.InputError, match=r"^initial"):
            mm.ensemble(mm.Disk(), initial=initial, duration=10.0, replicas=4, **NUMBERS)
