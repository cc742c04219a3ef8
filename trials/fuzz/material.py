"""Names that inputs refer to: valid runs, files and models, and ways to damage them.

An input is evaluated among these names, in a folder of its own.
"""

import itertools
import json
import shutil
import warnings
from concurrent.futures import Executor, Future
from datetime import datetime  # noqa: F401
from decimal import Decimal  # noqa: F401
from fractions import Fraction  # noqa: F401
from functools import cache
from math import inf, nan  # noqa: F401
from operator import attrgetter
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pandas as pd  # noqa: F401
import xarray as xr

import magmotor as mm
from magmotor import live  # noqa: F401
from magmotor.device import checkpoint
from magmotor.devices.top.states import BallStates
from magmotor.live.panel import Panel
from magmotor.mjcf.langevin.langevin import ALL_OF_STATE  # noqa: F401
from magmotor.numerics import linear_stability as linear  # noqa: F401

SHORT: dict[str, dict[str, Any]] = {
    "Top": {"method": "variational/verlet", "timestep": 0.01, "duration": 1.0},
    "Motor": {"method": "variational/baoab", "timestep": 0.1, "duration": 2000.0},
    "Disk": {"method": "variational/baoab", "timestep": 0.05, "duration": 50.0},
    "LangevinParticle": {"method": "variational/baoab", "timestep": 0.05, "duration": 50.0},
}
MARK = '<custom><text name="magmotor" data="all"/></custom>'
MODELS = {
    "pendulum": """<mujoco><worldbody><body pos="0 0 1"><joint axis="0 1 0" damping="0.1"/>
        <geom size="0.1" pos="0 0 -0.5"/></body></worldbody></mujoco>""",
    "empty": "<mujoco/>",
    "free": f"""<mujoco>{MARK}<size nuser_site="3"/><worldbody>
        <body><freejoint/><geom size="0.1"/><site user="2"/></body>
        <body pos="0 0 1"><freejoint/><geom size="0.1"/><site user="3"/></body>
        </worldbody></mujoco>""",
    "coincident": f"""<mujoco>{MARK}<size nuser_site="3"/><worldbody>
        <body><freejoint/><geom size="0.1"/><site user="2"/></body>
        <body><freejoint/><geom size="0.1"/><site user="3"/></body>
        </worldbody></mujoco>""",
    "slides": f"""<mujoco>{MARK}<size nuser_body="6" nuserdata="2"/>
        <option gravity="0 0 0"/><worldbody><body user="1 0 0 0 0 0">
        <joint type="slide" axis="1 0 0" damping="1"/>
        <joint type="slide" axis="0 1 0" damping="1"/><geom size="1" mass="2"/></body>
        </worldbody></mujoco>""",
    "other people's": """<mujoco><worldbody><body user="1 2 3 4 5 6 7 8 9">
        <joint type="slide" user="1123"/><geom size="1"/><site user="5"/></body></worldbody>
        </mujoco>""",
    "two on a chain": """<mujoco><worldbody><body><joint axis="0 1 0"/><geom size="0.1"/>
        <body pos="0 0 1"><joint type="ball"/><geom size="0.1"/></body></body></worldbody>
        </mujoco>""",
    "chain": """<mujoco><worldbody><body name="arm">
        <joint name="shoulder" type="ball" damping="0.1" stiffness="1"/>
        <geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02"/>
        <body name="hand" pos="0 0 -.3"><joint name="elbow" axis="0 1 0" damping="0.1"
        limited="true" range="-30 30" solreflimit="0.1 1"/>
        <geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02"/></body></body></worldbody>
        <equality><connect body1="hand" body2="world" anchor="0 0 -.3" solref=".2 1"/></equality>
        </mujoco>""",
    "arm": """<mujoco><option timestep="0.001"/><worldbody><body name="arm">
        <joint name="shoulder" axis="0 1 0" armature=".01"/>
        <geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02" mass="1"/><body pos="0 0 -.3">
        <joint name="elbow" axis="0 1 0" damping=".1"/>
        <geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02" mass="1"/></body></body>
        </worldbody><tendon><fixed name="rope" stiffness="1" damping=".05">
        <joint joint="shoulder" coef="1"/><joint joint="elbow" coef="-1"/></fixed></tendon>
        <actuator><position name="servo" joint="shoulder" kp="2" kv=".1"/>
        <motor name="motor" joint="elbow"/></actuator></mujoco>""",
    "beads": f"""<mujoco>{MARK}<size nuser_site="3" nuser_jnt="2"/><option viscosity="1"
        gravity="0 0 0"/><default><geom size=".1" contype="0" conaffinity="0"/></default><worldbody>
        <body name="bead"><freejoint/><geom/><site user="1"/></body>
        <body name="other bead" pos="0 0 1"><joint type="ball"/><geom pos="0 .1 0"/>
        <body name="wheel" pos="0 0 .3"><joint user="0 1"/><geom/><site user="1"/></body></body>
        </worldbody></mujoco>""",
    "grounded": """<mujoco><option viscosity="0.1"/><worldbody><geom type="plane" size="1 1 1"
        condim="1"/><body name="bead" pos="0 0 .1"><freejoint name="ball"/><geom size=".1"
        condim="1" solref=".1 1"/></body></worldbody></mujoco>""",
    "dry": """<mujoco><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 .1">
        <freejoint/><geom type="box" size=".1 .1 .1"/><body pos="0 0 .2"><joint name="elbow"
        damping=".1" frictionloss=".1" axis="0 1 0"/><geom size=".05"/></body></body>
        </worldbody></mujoco>""",
    "noisy": """<mujoco><option viscosity="0.1" integrator="RK4"/><worldbody><body><joint
        name="elbow" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.1" size=".01"/><body
        pos="0 0 -.1"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.1" size=".01"/>
        </body></body></worldbody></mujoco>""",
}  # fmt: skip
DRAFT = """<mujoco><size nuser_site="0"/><custom><numeric name="field_2" data="0 0 1"/></custom>
    <worldbody><geom name="table" type="plane" size="1 1 1"/><body name="hand" pos="0 0 1">
    <freejoint/><frame name="palm"/><geom name="ball" size=".1"/><geom size=".1"/><site name="tip"
    user="2"/></body></worldbody><actuator><general name="current" site="tip" gainprm="0"/>
    </actuator></mujoco>"""
CONTROLS = int(mujoco.mjtState.mjSTATE_CTRL)
TEMPERATURES = {
    "arm": {"shoulder": 0.5, "elbow": 0.2, "rope": 0.1},
    "beads": {"bead": 0.5, "other bead": 0.1, "wheel": 0.2},
}


@cache
def _run(kind: str, replicas: int | None) -> xr.Dataset:
    interval = 50 if kind == "Motor" else None
    scene = getattr(mm, kind)()
    return mm.simulate(scene, **SHORT[kind], replicas=replicas, record_interval=interval)


def run(kind: str, replicas: int | None = None) -> xr.Dataset:
    """A run of a scene with default fields."""
    return _run(kind, replicas).copy(deep=True)


@cache
def _many(kind: str) -> xr.Dataset:
    arguments = {**SHORT[kind], "replicas": 20, "trajectories": 2}
    return mm.ensemble(getattr(mm, kind)(), **arguments)


def many(kind: str = "Disk") -> xr.Dataset:
    """An ensemble."""
    return _many(kind if kind in ("Disk", "LangevinParticle") else "Disk").copy(deep=True)


def plan(kind: str, measure: str | None = None) -> mm.sweep.Sweep:
    """A sweep of two cases."""
    scene = getattr(mm, kind)()
    field = "coupling" if kind == "Motor" else "friction"
    measure = measure or next(iter(mm.sweep.measures(scene)))
    few = {**SHORT[kind], "duration": 20 * SHORT[kind]["timestep"]}
    values = [0.9 * getattr(scene, field), getattr(scene, field)]
    return mm.sweep.Sweep(scene=scene, vary={field: values}, measure=[measure], **few)


class Here(Executor):
    """Executor that computes in the calling thread."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@cache
def _folder(kind: str, measure: str | None) -> Path:
    path = Path("..").resolve() / f"sweep {kind} {measure}"
    shutil.rmtree(path, ignore_errors=True)
    mm.sweep.run(plan(kind, measure), path, executor=Here(), workers=1)
    return path


def folder(kind: str, measure: str | None = None) -> Path:
    """The directory of a finished sweep."""
    copy = Path(f"sweep{next(_numbers)}")
    shutil.copytree(_folder(kind, measure), copy)
    return copy


_numbers = itertools.count()


@cache
def _grid(kind: str) -> xr.Dataset:
    return mm.sweep.combine(_folder(kind, None))


def grid(kind: str) -> xr.Dataset:
    """The result of a sweep."""
    return _grid(kind).copy(deep=True)


def states(kind: str = "Top") -> BallStates:
    """The states of a run of the top."""
    found = run("Top")
    return BallStates(*(found[name].values for name in BallStates._fields))


_models: dict[str, mujoco.MjModel] = {}


def specification(kind: str) -> mujoco.MjSpec:
    """A user's model that is not yet compiled."""
    return mujoco.MjSpec.from_string(MODELS[kind])


_drafts: list[mujoco.MjSpec] = []


def draft() -> mujoco.MjSpec:
    """A spec to which something is added; `drafted` is the same one, for its elements."""
    _drafts[:] = [mujoco.MjSpec.from_string(DRAFT)]
    return drafted()


def drafted() -> mujoco.MjSpec:
    """The last draft, or the first one."""
    return _drafts[0] if _drafts else draft()


def model(kind: str) -> mujoco.MjModel:
    """A model, the same one whenever an input refers to it."""
    if kind not in _models:
        xml = MODELS.get(kind)
        made = mujoco.MjModel.from_xml_string(xml) if xml else mm.build(getattr(mm, kind)())
        _models[kind] = made
    return _models[kind]


def changed(thing: Any, name: str, value: Any) -> Any:
    """A model or its data with changed numbers in an array."""
    if isinstance(thing, list):
        return [changed(thing[0], name, value), *thing[1:]]
    owner, _, last = name.rpartition(".")
    place = attrgetter(owner)(thing) if owner else thing
    if isinstance(array := getattr(place, last), np.ndarray):
        array[...] = value
    else:
        setattr(place, last, value)
    return thing


def data(kind: str) -> mujoco.MjData:
    """Data of a model."""
    return mujoco.MjData(model(kind))


def tossed(kind: str) -> mujoco.MjData:
    """Data of a model in motion, with controls and applied forces."""
    made = data(kind)
    random = np.random.default_rng(1)
    mujoco.mj_integratePos(made.model, made.qpos, random.normal(size=made.model.nv), 0.1)
    for array in (made.qvel, made.ctrl, made.qfrc_applied):
        array[:] = 0.1 * random.normal(size=array.shape)
    return made


def temperatures(kind: str) -> dict[str, float] | float:
    """Temperatures of the baths of a model."""
    return TEMPERATURES.get(kind, 0.5)


def langevin(kind: str, **options: Any) -> mm.Langevin:
    """A thermostat of a model."""
    return mm.Langevin(model(kind), 0.5, **options)


@cache
def _sampled(kind: str) -> xr.Dataset:
    disable = ("contact", "frictionloss") if kind == "dry" else ()
    fresh = mujoco.MjModel.from_xml_string(MODELS[kind])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        thermostat = mm.Langevin(fresh, 0.5, friction=1.0, disable=disable)
        made = mujoco.MjData(fresh)
        made.qfrc_applied[:] = 0.1
        return thermostat.sample(
            100 * thermostat.timestep, replicas=2, record_interval=5, initial=made
        )


def sampled(kind: str) -> xr.Dataset:
    """A run of a model."""
    return _sampled(kind).copy(deep=True)


def states_of(kind: str) -> Any:
    """Two initial states of a model: time, positions and velocities."""
    made = tossed(kind)
    return np.array([[0.0, *made.qpos, *made.qvel]] * 2)


def controls(kind: str) -> Any:
    """Two controls of a model."""
    return np.full((2, 1, model(kind).nu), 0.1)


def perturb(body: int = 1) -> mujoco.MjvPerturb:
    """The mouse, pulling on a body."""
    mouse = mujoco.MjvPerturb()
    mouse.select, mouse.active = body, 1
    return mouse


def panel(kind: str) -> Panel:
    """Sliders of a scene."""
    return Panel(getattr(mm, kind)())


def stepped(model: mujoco.MjModel, data: tuple[str, float] | None = None) -> mujoco.MjData:
    """Data after some steps with magnetism, starting from changed numbers in an array."""
    moved = mujoco.MjData(model)
    if data is not None:
        changed(moved, *data)
    with mm.magnetism():
        mujoco.mj_forward(model, moved)
        mujoco.mj_step(model, moved, 3)
    return moved


# Damage to datasets -------------------------------------------------------------------------


def _name(dataset: xr.Dataset, place: int) -> Any:
    names = [*dataset.variables]
    return names[place % len(names)]


def _holding(dataset: xr.Dataset, name: Any, values: Any) -> xr.Dataset:
    """Replace the values of a variable or coordinate."""
    assign = dataset.assign_coords if name in dataset.coords else dataset.assign
    return assign({name: (dataset[name].dims, values)})


def dropped(dataset: xr.Dataset, place: int) -> xr.Dataset:
    """Remove a variable."""
    return dataset.drop_vars(_name(dataset, place))


def renamed(dataset: xr.Dataset, place: int) -> xr.Dataset:
    """Rename a variable."""
    return dataset.rename({_name(dataset, place): "other"})


def recast(dataset: xr.Dataset, place: int, dtype: str) -> xr.Dataset:
    """Change the type of a variable."""
    name = _name(dataset, place)
    with np.errstate(all="ignore"):
        values = dataset[name].values
        if dtype != "str" and values.dtype.kind not in "biuf":
            dtype = "object"
        return _holding(dataset, name, values.astype(dtype))


def poisoned(dataset: xr.Dataset, place: int, value: Any, everywhere: bool = False) -> xr.Dataset:
    """Put a NaN or a huge number into a variable."""
    name = _name(dataset, place)
    values = dataset[name].values.astype(float if dataset[name].dtype.kind in "biuf" else object)
    values.reshape(-1)[slice(None) if everywhere else slice(values.size // 2, None, 10**6)] = value
    return _holding(dataset, name, values)


def turned(dataset: xr.Dataset) -> xr.Dataset:
    """Reverse the order of the dimensions."""
    return dataset.transpose(*reversed([*dataset.dims]))


def picked(dataset: xr.Dataset, place: int, index: Any) -> xr.Dataset:
    """Select a part along a dimension, or drop the dimension."""
    names = [*dataset.dims]
    return dataset.isel({names[place % len(names)]: index})


def with_attribute(dataset: xr.Dataset, place: int, value: Any) -> xr.Dataset:
    """Change or remove an attribute."""
    names = [*dataset.attrs]
    name = names[place % len(names)]
    if value is dropped:
        del dataset.attrs[name]
        return dataset
    return dataset.assign_attrs({name: value})


def bare(dataset: xr.Dataset) -> xr.Dataset:
    """Remove all attributes."""
    return dataset.drop_attrs()


# Damage to files ----------------------------------------------------------------------------


class Damaged:
    """A checkpoint that the same call wrote and that was then damaged: see `made`."""

    def __init__(self, how: str, place: float = 0.5, value: Any = None):
        self.how, self.place, self.value = how, place, value

    def made(self, path: Path) -> Path:
        """Damage the file; if arrays are changed, the checksums are right."""
        if self.how in ("cut", "flip", "empty"):
            return damaged_file(path, self.how, self.place)
        line, _, content = path.read_bytes().partition(b"\n")
        head = json.loads(line[line.index(b"{") :])
        arrays, begin = {}, 0
        for name, dtype, *shape in head["arrays"]:
            size = np.dtype(dtype).itemsize * int(np.prod(shape))
            arrays[name] = np.frombuffer(content[begin : begin + size], dtype).reshape(shape)
            begin += size
        name = [*arrays][int(self.place * len(arrays))]
        done = head["done"]
        if self.how == "drop":
            del arrays[name]
        elif self.how == "add":
            arrays["other"] = np.zeros(3)
        elif self.how == "halve":
            arrays[name] = arrays[name][: len(arrays[name]) // 2]
        elif self.how == "done":
            done = self.value
        else:
            shape = arrays[name].shape if self.how == "fill" else ()
            arrays[name] = np.full(shape, self.value) if shape else np.asarray(self.value)
        checkpoint.save(path, head["task"], done, arrays)
        return path


def damaged_file(path: Path, how: str, place: float = 0.5) -> Path:
    """Flip a bit of a file or of one in a folder, or cut, empty, remove or replace the file."""
    file = path
    if path.is_dir():
        files = sorted(p for p in path.rglob("*") if p.is_file())
        file = files[int(place * 997) % len(files)]
    content = bytearray(file.read_bytes())
    at = int(place * len(content))
    if how == "remove":
        file.unlink()
    elif how == "folder":
        file.unlink()
        file.mkdir()
    else:
        if how == "flip":
            content[at] ^= 1 << int(place * 7919) % 8
        file.write_bytes({"flip": content, "cut": content[:at], "empty": b""}[how])
    return path


def rewritten(path: Path, place: int, value: Any) -> Path:
    """Change a value in the `sweep.json` of a folder."""
    file = path / "sweep.json"
    try:
        content = json.loads(file.read_text())
    except ValueError:
        return path
    file.write_text(json.dumps(replaced(content, place, value)))
    return path


def replaced(content: Any, place: int, value: Any) -> Any:
    """Change or remove a value in nested lists and dictionaries."""
    places: list[tuple[Any, Any]] = []

    def walk(part: Any) -> None:
        items = part.items() if isinstance(part, dict) else enumerate(part)
        for key, inner in items:
            places.append((part, key))
            if isinstance(inner, dict | list):
                walk(inner)

    content = json.loads(json.dumps(content))
    walk(content)
    owner, key = places[place % len(places)]
    if value is dropped:
        del owner[key]
    else:
        owner[key] = value
    return content


def full_disk() -> Path:
    """A file that cannot be written to: a link, since a regular file may be replaced."""
    Path("full").symlink_to("/dev/full")
    return Path("full")


# Damage to arrays ---------------------------------------------------------------------------


def holding(array: Any, value: Any) -> Any:
    """Change one element of an array."""
    copy = np.array(array, dtype=float if isinstance(value, int | float) else object)
    copy.reshape(-1)[copy.size // 2 :: 10**6] = value
    return copy


def frozen(array: Any) -> Any:
    """Make an array read-only."""
    copy = np.array(array)
    copy.flags.writeable = False
    return copy


def spread(array: Any) -> Any:
    """Make an array noncontiguous."""
    return np.repeat(np.asarray(array), 2, axis=-1)[..., ::2] if np.ndim(array) else array


NAMESPACE = {name: value for name, value in globals().items() if name[0] != "_"}
