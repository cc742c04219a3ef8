"""Sweeps: what they vary and measure, their designs, folders and pictures."""

import json
import os
from concurrent.futures import Executor, Future
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import numpy as np
import xarray as xr

import magmotor as mm
from magmotor.sweep import Samples
from magmotor.sweep.dask_cluster import Cluster

driver = import_module("magmotor.sweep.driver")

DISK: dict[str, Any] = {
    "scene": mm.Disk(),
    "method": "variational/baoab",
    "timestep": 0.05,
    "duration": 5.0,
}
TOP: dict[str, Any] = {"scene": mm.Top(), "measure": ["max_spin"], "duration": 1.0}
NAMES = (
    "position_x position_y velocity_x velocity_y axis_x axis_y axis_z spin tilt coupling friction"
)


class Here(Executor):
    """Computes each case when it is submitted."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.set_result(fn(*args, **kwargs))
        return future


class Gone(Executor):
    """Drops each case."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.cancel()
        return future


class Confused(Cluster):
    """Fails by itself."""

    def __init__(self):
        """Need no client."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.set_exception(AttributeError("'NoneType' object has no attribute"))
        return future

    def threads(self):
        return 1


class Empty(Cluster):
    """Has no workers."""

    def __init__(self):
        """Need no client."""

    def submit(self, fn, /, *args, **kwargs):
        return Future()

    def threads(self):
        return 0


def sweep(**changes):
    """Plan a sweep of a disk."""
    return mm.sweep.Sweep(**{**DISK, "measure": ["displacement"], "vary": {"v": (1, 2)}, **changes})


def top(**changes):
    """Plan a sweep of a top."""
    return mm.sweep.Sweep(**{**TOP, **changes})


def run(folder, executor=Here, **changes):
    """Run a sweep of a disk in a folder."""
    return mm.sweep.run(sweep(**changes), folder, executor=executor())


def spin(run, scene):
    """Measure that a user has written."""
    return float(abs(run.momentum_map).max())


def script(run, scene):
    """Measure in the file that is run."""


script.__module__ = "__main__"


class Mute(Exception):
    """An error without text."""

    def __str__(self):
        raise RuntimeError


def mute(run, scene):
    """Measure that fails and does not say why."""
    raise Mute


def swept(*fields):
    """Return a measure of a design over these fields."""
    variables = {"momentum": ("sample", np.arange(3.0), {"units": "1"})}
    coords = {name: ("sample", [1.0, 2.0, 3.0], {"units": "1"}) for name in fields}
    return xr.Dataset(variables, coords, {"axes": '["sample"]'})


TABLE = r"""
# What a sweep varies
>>> sweep(vary={})
ArgumentError: vary = {}: must have at least one field
>>> sweep(vary={"nois": (1,)})
ArgumentError: field = 'nois': must be one of friction, noise, x, v, sigma, friction_ratio, drag,
    rotational_drag, drag_temperature, theta, omega (did you mean 'noise'?)
>>> sweep(vary={"noise": ()})
ArgumentError: noise = []: must have at least one value
>>> sweep(vary={"noise": (1, 1.0)})
ArgumentError: noise = (1.0, 1.0): must be distinct values
>>> sweep(vary={"noise": (-1,)})
ArgumentError: noise = -1: must be at least 0
>>> sweep(vary={"noise": (1,), ("noise", "x"): (2,)})
ArgumentError: field = 'noise': must be varied only once
>>> sweep(vary={"potential": (1,)})
ArgumentError: field = 'potential': must be one of friction, noise, x, v, sigma, friction_ratio,
    drag, rotational_drag, drag_temperature, theta, omega
>>> sweep(samples=Samples({"v": (0, 1)}, 4))
ArgumentError: field = 'v': must be varied only once
>>> sweep(samples=Samples({"noise": (-1, 1)}, 4))
ArgumentError: noise = -1: must be at least 0
>>> top(samples=Samples({"tilt": (0.1, 2)}, 4))
ArgumentError: tilt = 2: must be less than 1.5708 rad (2 degrees are 0.03491 rad)
>>> top(vary={"tilt": (1.5,)})
ArgumentError: tilt = 1.5: must be less than 0.6289 rad, where the ring touches the floor
>>> top(vary={"ring_dipoles": (5.5,)}, timestep=0.01)
ArgumentError: ring_dipoles = 5.5: must be an integer
>>> top(samples=Samples({"ring_dipoles": (5, 20)}, 4), timestep=0.01)
ArgumentError: field = 'ring_dipoles': takes integers only: list its values instead of drawing
    them
>>> sweep(scene=mm.Motor(), vary={"position_x": (0.1,)}, measure=["flights"])
ArgumentError: position = None: the scene must give it a value if position_x is to vary

# What a sweep measures
>>> sweep(measure=[])
ArgumentError: measure = []: must be distinct names, at least one
>>> sweep(measure=["temprature"])
ArgumentError: measure = 'temprature': must be one of displacement, square_displacement,
    largest_displacement, temperature, mean_energy, slip_temperature, trajectory (did you mean
    'temperature'?)
>>> sweep(measure=["trajectory", "displacement"])
ArgumentError: measure = ['trajectory', 'displacement']: trajectory excludes other measures
>>> sweep(measure=["nowhere:f"])
ArgumentError: measure = 'nowhere:f': must be a function that can be imported (No module named
    'nowhere')
>>> sweep(measure=["sweep_measures:f"])
ArgumentError: measure = 'sweep_measures:f': must be a function that can be imported (module
    'sweep_measures' has no attribute 'f')
>>> top(vary={"tilt": [0.02]}, measure="max_spin")
ArgumentError: measure = 'max_spin': must be a list of names: write ['max_spin']
>>> top(vary={"tilt": [0.02]}, measure=["maxspin"])
ArgumentError: measure = 'maxspin': must be one of max_spin, final_spin, max_momentum_map,
    settling_radius, settling_speed, momentum_residual, trajectory (did you mean 'max_spin'?)
>>> top(vary={"tilt": [0.02]}, measure=spin)
ArgumentError: measure = [<function spin at ...>]: must be a list of names; a function is named by
    'module:function': write 'sweeps:spin'
>>> top(vary={"tilt": [0.02]}, measure=[spin])
ArgumentError: measure = [<function spin at ...>]: must be a list of names; a function is named by
    'module:function': write 'sweeps:spin'
>>> top(vary={"tilt": [0.02]}, measure=[script])
ArgumentError: measure = [<function script at ...>]: must be a list of names; a function is named
    by 'module:script': put it into a file of its own, such as measures.py, since workers do not
    run this one, and write 'measures:script'
>>> top(vary={"tilt": [0.02]}, measure=["__main__:spin"])
ArgumentError: measure = '__main__:spin': put it into a file of its own, such as measures.py,
    since workers do not run this one, and write 'measures:spin'

# The numbers of a sweep
>>> sweep(seeds=0)
ArgumentError: seeds = 0: must be at least 1
>>> sweep(seeds=[])
ArgumentError: seeds = []: must be distinct, and at least one
>>> sweep(seeds=[1, -1])
ArgumentError: seed = -1: must be at least 0
>>> sweep(replicas=0)
ArgumentError: replicas = 0: must be at least 1
>>> sweep(method="baoab")
ArgumentError: method = 'baoab': must be one of variational/euler, variational/verlet,
    variational/baoab, variational/middle, mujoco/euler, mujoco/implicitfast, mujoco/rk4,
    mujoco/baoab (did you mean 'variational/baoab' or 'mujoco/baoab'?)
>>> sweep(timestep=0)
ArgumentError: timestep = 0: must be greater than 0
>>> sweep(duration=0.01)
ArgumentError: duration = 0.01: must be at least 0.05
>>> sweep(record_interval=0)
ArgumentError: record_interval = 0: must be at least 1
>>> top(vary={"tilt": (0.0, 0.1)}, engine="scipy")
ArgumentError: engine = 'scipy': must be one of mujoco, any
>>> top(scene=mm.Top(surface="plane"), vary={"coulomb_friction": (0.0, 0.1)})
ArgumentError: coulomb_friction = 0.1: the charts have no dry friction, with which the error
    depends on the coefficient more than on the timestep: pass a method and a timestep to simulate
>>> top(samples=Samples(dict.fromkeys(NAMES.split(), (0.1, 0.2)), 4))
ArgumentError: timestep = None: must be given if more than 10 fields vary

# Sweeps that are too large
>>> line = np.linspace(0.1, 4, 10_001)
>>> sweep(vary={"noise": line, "x": line})
ArgumentError: cases times replicas = 100020001: must be at most 100000000
>>> sweep(vary={"noise": (1.0,)}, replicas=10**12)
ArgumentError: cases times replicas = 1000000000000: must be at most 100000000
>>> sweep(vary={"noise": (1.0,)}, seeds=10**15)
ArgumentError: number of values of seeds = 'over 1048576': must be at most 1048576
>>> Samples({"x": (0, 1)}, 2**40)
ArgumentError: size = 1099511627776: must be at most 1048576

# Designs
>>> Samples({}, 4)
ArgumentError: ranges = {}: must be ranges of at least one field
>>> Samples({"x": (0, 1)}, 0)
ArgumentError: size = 0: must be at least 1
>>> Samples({"x": (0, 1)}, 100)
ArgumentError: size = 100: must be a power of two (for example 128) for design 'sobol'
>>> Samples({"x": (0, 1)}, 8, "sobel")
ArgumentError: design = 'sobel': must be one of random, latin, sobol (did you mean 'sobol'?)
>>> Samples({"x": (1, 1)}, 8)
ArgumentError: x, upper end of a range from 1 = 1: must be greater than 1
>>> Samples({"x": (0, 1, True)}, 8)
ArgumentError: x, lower end of a logarithmic range = 0: must be greater than 0
>>> Samples({"x": (0, 1)}, 8, "sobol", -1)
ArgumentError: seed = -1: must be at least 0

# Folders of sweeps
>>> here = TemporaryDirectory()
>>> folder = Path(here.name, "s")
>>> tally = run(folder)
>>> run(folder, duration=6.0, vary={"x": (1, 2)})
ArgumentError: directory = '.../s': must be empty or hold this sweep; it holds one that differs in
    duration, vary: give this sweep another folder (on the command line, --out)
>>> notes = Path(here.name, "notes")
>>> notes.mkdir()
>>> file = notes / "mine.txt"
>>> file.touch()
>>> run(notes)
ArgumentError: directory = '.../notes': must be empty or hold this sweep; it holds mine.txt: give
    this sweep another folder (on the command line, --out)
>>> run(file)
ArgumentError: directory = '.../notes/mine.txt': must be a folder
>>> mm.sweep.status(Path(here.name, "nowhere"))
ArgumentError: directory = '.../nowhere': must be the folder of a sweep: it has no sweep.json
>>> mm.sweep.combine(Path(here.name, "nowhere"))
ArgumentError: directory = '.../nowhere': must be the folder of a sweep: it has no sweep.json
>>> result, second = sorted(folder.glob("done/*/*"))
>>> whole = result.read_bytes()
>>> result.write_bytes(whole[:-9] + b"x" + whole[-8:]) > 0
>>> mm.sweep.combine(folder)
InputError: done/.../....json is damaged: its checksum differs: run the sweep in '.../s' again to
    recompute these cases, or leave them out by skip_damaged=True (--skip-damaged)
>>> tally = run(folder)
UserWarning: done/.../....json is damaged: its checksum differs; the case is recomputed
>>> result.write_bytes(second.read_bytes()) > 0
>>> mm.sweep.combine(folder)
InputError: done/.../....json is damaged: it belongs to another case: run the sweep in '.../s'
    again to recompute these cases, or leave them out by skip_damaged=True (--skip-damaged)
>>> result.unlink()
>>> os.mkfifo(result)
>>> tally = run(folder)
UserWarning: done/.../....json is damaged: it is not a regular file; the case is recomputed
>>> result.unlink()
>>> result.mkdir()
>>> mm.sweep.status(folder)
ArgumentError: directory = '.../s/done/.../....json': must be a file: remove this folder, since a
    sweep never removes folders
>>> result.rmdir()
>>> claims = folder / "claims"
>>> claims.rmdir()
>>> claims.symlink_to(notes)
>>> run(folder)
ArgumentError: directory = '.../s/claims': must be a folder: a sweep follows no symbolic link out
    of its folder
>>> plan = folder / "sweep.json"
>>> plan.write_bytes(plan.read_bytes()[:-1]) > 0
>>> mm.sweep.status(folder)
ArgumentError: directory = '.../s': sweep.json is damaged: its checksum differs; running the same
    sweep again repairs it
>>> here.cleanup()

# Sweeps that fail
>>> here = TemporaryDirectory()
>>> run(Path(here.name, "dropped"), Gone)
NoWorkers: the executor dropped a case: is the cluster gone?
>>> run(Path(here.name, "confused"), Confused)
NoWorkers: the cluster returned a case uncomputed (AttributeError: 'NoneType' object has no
    attribute)
>>> with (
...     patch.object(driver, "POLL_SECONDS", 0.02),
...     patch.object(driver, "LOST_SECONDS", 0.1),
... ):
...     run(Path(here.name, "empty"), Empty)
NoWorkers: the cluster has had no workers for 0.1 s; 2 cases: 0 done, 0 failed, 2 missing
>>> run(Path(here.name, "shape"), measure=["sweep_measures:three"])
SweepFailed: all 2 cases of the sweep failed, the first of them with: shape of a measure = (3,):
    must be (): a run without replicas has one value
>>> run(Path(here.name, "two"), measure=["sweep_measures:three"], replicas=2)
SweepFailed: all 2 cases of the sweep failed, the first of them with: shape of a measure = (3,):
    must be () or (replicas,)
>>> run(Path(here.name, "mute"), measure=["sweeps:mute"])
SweepFailed: all 2 cases of the sweep failed, the first of them with: Mute
>>> lifted = {"scene": mm.Top.si(), "measure": ["max_spin"], "vary": {"tilt": (0.0, 0.1)}}
>>> run(Path(here.name, "lifted"), **lifted, method="variational/verlet", timestep=0.005)
SweepFailed: all 2 cases of the sweep failed, the first of them with: variational/verlet with
    timestep 0.005 s stopped at t = ... s: the magnetic lift, ... N, exceeds the ball's weight,
    1.96 N, and the plane cannot hold it down: use a larger gravity or surface = 'plane'
>>> old = {**sweep().versions, "numpy": "1.0"}
>>> run(Path(here.name, "old"), versions=old)
OtherVersions: a worker has {'magmotor': ..., 'machine': ...}, but the sweep has {'magmotor': ...,
    'numpy': '1.0', ...}
>>> run(Path(here.name, "old"))
ArgumentError: directory = '.../old': must be empty or hold this sweep; it holds one that differs
    in versions: give this sweep another folder (on the command line, --out)
>>> run(Path(here.name, "full"), measure=["sweep_measures:saved"], vary={"noise": (2.0, 3.0)})
OSError: [Errno 28] No space left on device: 'disk/file'
>>> here.cleanup()

# Measures of other people
>>> here = TemporaryDirectory()
>>> folder = Path(here.name, "s")
>>> tally = run(folder, measure=["sweep_measures:changing"])
>>> mm.sweep.run(mm.sweep.sweep_of(folder), Path(here.name, "new"), executor=Here())
ArgumentError: measure = 'sweep_measures:changing': must be allowed explicitly, since its name is
    from a file: pass measures=['sweep_measures:changing'] to sweep_of or rerun, or run magmotor
    rerun --allow-measure sweep_measures:changing
>>> mm.sweep.sweep_of(folder, measures=["sweep_measures:no"])
ArgumentError: measures = 'sweep_measures:no': must be one of sweep_measures:changing (did you
    mean 'sweep_measures:changing'?)
>>> mm.rerun(mm.sweep.combine(folder))
ArgumentError: measure = 'sweep_measures:changing': must be allowed explicitly, since its name is
    from a file: pass measures=['sweep_measures:changing'] to sweep_of or rerun, or run magmotor
    rerun --allow-measure sweep_measures:changing
>>> here.cleanup()

# Pictures of sweeps
>>> mm.plots.sweep(swept("tilt", "friction", "height"), "sweep.png")
ArgumentError: axes = ['tilt', 'friction', 'height']: must be one or two varying fields: select
    one value of every other (isel, sel)
>>> mm.plots.sweep(swept("tilt").isel(sample=[2]), "sweep.png")
ArgumentError: axes = []: must be one or two varying fields: select one value of every other
    (isel, sel)
>>> mm.plots.sweep(swept("tilt").expand_dims(time=[0.0, 1.0]), "sweep.png")
ArgumentError: measures = ['momentum']: must include a number over the dimensions of ['tilt']
>>> mm.plots.sweep(swept("tilt").drop_attrs(), "sweep.png")
ArgumentError: attributes = []: must be those of a combined sweep, where axes is a JSON list of
    names
"""
