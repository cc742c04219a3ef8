"""Datasets: observables of runs, plots, tables, and what the attributes must tell."""

import json
import sys
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import xarray as xr

import magmotor as mm
from magmotor.device.overview import draw_variables
from magmotor.noise import path_of
from magmotor.run.to_table import write_table
from paper.bracket import bracket
from paper.figure import Claim
from paper.motor.exponential_test import exponential_test
from paper.motor.rotor import rotor
from paper.top.dry_friction import held_axis
from paper.top.lift import largest_lift_map, lift_map

BAOAB: dict[str, Any] = {"method": "variational/baoab"}
balance = mm.observables.energy_balance


def disks(**changes):
    """Simulate three disks for 300 steps."""
    arguments: dict[str, Any] = {"timestep": 0.01, "duration": 3, "replicas": 3, "seed": 5}
    return mm.simulate(mm.Disk(v=1.0), **(arguments | BAOAB | changes))


def motors():
    """Simulate three motors for 100 steps."""
    return mm.simulate(mm.Motor(), timestep=0.1, duration=10, replicas=3, seed=5, **BAOAB)


def top():
    """Simulate a top for 100 steps."""
    return mm.simulate(mm.Top.paper(4, spin=3.0), timestep=0.01, duration=1.0, **BAOAB)


def many():
    """Simulate an ensemble of disks."""
    arguments: dict[str, Any] = {
        "timestep": 0.05,
        "duration": 100.0,
        "replicas": 8,
        "trajectories": 8,
    }
    return mm.ensemble(mm.Disk(), **arguments, **BAOAB)


def around(*angles):
    """Return a path of a ball on a circle."""
    theta = np.array(angles)
    place = np.stack([np.cos(theta), np.sin(theta), 0 * theta], axis=-1)
    time = np.arange(float(len(theta)))
    return xr.Dataset({"position": (("time", "space"), place)}, {"time": time, "space": [*"xyz"]})


TABLE = r"""
# What an energy balance needs
>>> run = disks()
>>> balance(run.isel(time=slice(None, None, 10)))
ArgumentError: steps between two records = 10: must be 1, since the noise of every step is needed
>>> balance(run.drop_vars("step"))
ArgumentError: coordinates = ['time', 'replica']: must include step, a number for each time, as
    simulate writes it
>>> balance(run.drop_vars("replica"))
ArgumentError: run.replica = None: must be a coordinate with the numbers of the replicas
>>> balance(run.isel(time=[0]))
ArgumentError: number of records in run = 1: must be at least 2
>>> balance(run.drop_vars("omega"))
ArgumentError: run = ['x', 'v', 'theta', 'energy']: the dataset must also have omega

# Runs that were joined or averaged
>>> run = disks()
>>> balance(xr.concat([run, disks(seed=6)], "replica"))
ArgumentError: run.replica = [0, 1, 2, 0, 1, 2]: must be distinct numbers, each less than 3
>>> balance(run.assign_coords(replica=[0, 1, 7]))
ArgumentError: run.replica = [0, 1, 7]: must be distinct numbers, each less than 3
>>> balance(run.mean("replica", keep_attrs=True))
ArgumentError: run.replica = None: must be a coordinate with the numbers of the replicas
>>> balance(run.isel(time=slice(-1)).coarsen(time=2).mean(keep_attrs=True))
ArgumentError: run.step = 'float64': must be integers: the records must be a run's own, not
    averages
>>> balance(xr.concat([run, run.assign_coords(time=run.time + 31)], "time"))
InputError: run.step must increase: the records must be of one run

# Datasets that are not runs
>>> run = top()
>>> momentum = mm.observables.momentum_balance
>>> momentum(run.position)
ArgumentError: run = <xarray.DataArray 'position' ...: must be an instance of xarray.Dataset
>>> momentum(run.drop_vars("slip_velocity"))
ArgumentError: run = ['position', 'velocity', 'axis', 'angular_velocity', 'momentum_map',
    'energy', 'orientation']: the dataset must also have slip_velocity
>>> momentum(run.drop_vars("time"))
ArgumentError: run.time = None: must be a coordinate of numbers
>>> momentum(run.assign(axis=run.axis + 0j))
ArgumentError: dtype of run.axis = 'complex128': must be real numbers
>>> momentum(run.assign(axis=run.axis * np.nan))
InputError: run.axis holds values that are not finite or exceed 1e+30
>>> momentum(run.isel(space=0))
ArgumentError: dimensions of run.axis = ('time',): must be ('time', 'space')
>>> momentum(run.isel(space=[0, 1]))
ArgumentError: length of space in run.axis = 2: must be 3
>>> momentum(run.isel(space=[1, 0, 2]))
ArgumentError: run.space = ['y', 'x', 'z']: must be x, y, z
>>> momentum(run.isel(time=[]))
ArgumentError: shape of run.axis = (0, 3): the array must not be empty
>>> momentum(run.isel(time=0))
ArgumentError: dimensions of run.axis = ('space',): must be ('time', 'space')
>>> momentum(run.isel(time=slice(None, None, -1)))
InputError: run.time must hold finite times that increase
>>> momentum(xr.concat([run, run], "replica"))
ArgumentError: replicas = 2: select one: run.isel(replica=0)
>>> momentum(run.assign_attrs(disks().attrs))
InputError: run is of a Disk: must be of a Top
>>> momentum(run.assign_attrs(scene=np.array(["Top", "Disk"])))
InputError: scene = array(['Top', 'Disk'], dtype='<U4') in the dataset's attributes: must be one
    of ['Disk', ...]; import the module that defines the scene class first

# The scene of a run
>>> run = top()
>>> mm.observables.momentum_balance(run, mm.Top(friction=0.2))
ArgumentError: scene.friction = 0.2: must be 0.3, as in the run
>>> mm.observables.momentum_balance(run, mm.Top.paper(4, spin=3.0, gravity=0.5))
ArgumentError: scene.gravity = 0.5: must be 9.81, as in the run
>>> mm.observables.momentum_balance(run.drop_attrs())
ArgumentError: scene = None: must be given, since the run's attributes have no scene
>>> mm.observables.flights(run)
InputError: run is of a Top: must be of a Motor
>>> mm.plots.overview(run, mm.Motor(), "overview.png")
ArgumentError: scene = Motor(...): must be the scene of the run, a Top, or None for that scene
>>> balance(disks(), mm.Disk(v=1.0, x=0.5))
ArgumentError: scene.x = 0.5: must be 0.0, as in the run
>>> mm.observables.momentum_map(mm.Top(center_of_mass=(1e-4, 0, 0)), np.eye(3), np.eye(3))
ArgumentError: scene = Top(...): must be a balanced ball; simulate records the momentum map of
    another one

# The motion of a motor
>>> run = motors()
>>> mm.observables.azimuth(around(0.0, 1.6))
ArgumentError: largest rotation between two records = 1.6: must be at most 1.57 rad: record more
    often, or the ball went through the center
>>> mm.observables.azimuth(run.drop_vars("space"))
ArgumentError: run.position.space = None: must be a coordinate: x, y, z
>>> half = run.ring_orientation.values.copy()
>>> half[:, 1::2] = [0.0, 0.0, 0.0, 1.0]
>>> turned = run.assign(ring_orientation=(run.ring_orientation.dims, half))
>>> mm.observables.ring_attitude(turned)
ArgumentError: largest rotation between two records = 3.14: must be at most 1.57 rad: record more
    often, or the ring is upside down
>>> mm.observables.mode_temperatures(run, burn_in=9.5)
ArgumentError: burn_in = 9.5: must leave at least 16 records
>>> mm.plots.overview(run, None, "overview.png")
ArgumentError: replicas = 3: select one: run.isel(replica=0)

# Ensembles
>>> run = many()
>>> mm.observables.local_slope(run.isel(time=slice(5, None)))
ArgumentError: first time in run = 5.0: must be 0, since displacements count from the start
>>> mm.observables.local_slope(run, 1000)
ArgumentError: factor = 1000.0: must be at most the ratio of the last recorded time to the first
    after zero
>>> mm.observables.flight_survival(run.isel(flight_duration=slice(None, None, 2)))
ArgumentError: flight_duration = [1.0, ...: must have all bins of the ensemble
>>> mm.observables.flight_survival(run.isel(flight_duration=slice(1, None)))
ArgumentError: flight_duration = [1.189207115002721, ...: must have all bins of the ensemble
>>> mm.observables.flight_survival(run.isel(flight_duration=slice(-1)))
ArgumentError: flight_duration = [1.0, ...: must have all bins of the ensemble
>>> draw_variables(run.isel(time=-1), "overview.png")
ArgumentError: run = ['mean', 'mean_error', 'mean_square', 'mean_square_error',
    'increment_correlation', 'increment_correlation_error', 'mean_square_increment',
    'mean_square_increment_error', 'density_x', 'density_v', ...: must have variables over time
>>> del run.attrs["burn_in"]
>>> mm.observables.flight_survival(run)
ArgumentError: attributes = ['scene', 'scene_fields', 'versions', 'method', 'timestep',
    'duration', 'replicas', 'seed', 'sample_interval', 'trajectories', 'time_reached']: must
    include burn_in

# Tables
>>> run = top()
>>> mm.to_table(xr.Dataset())
ArgumentError: data = {}: must have variables
>>> mm.to_table(run, rows=["space"])
ArgumentError: rows = 'space': must be one of time
>>> mm.to_table(run, rows=[])
ArgumentError: rows = []: must name at least one dimension, and each only once
>>> mm.to_table(run.isel(time=slice(0)))
ArgumentError: data = {'time': 0, 'space': 3, 'component': 4}: must have at least one time
>>> mm.to_table(run.assign(position_x=run.energy))
ArgumentError: data = 'position_x': must be the name of one column only: rename one
>>> write_table(mm.to_table(run), Path("run.txt"))
ArgumentError: path = 'run.txt': must end in .csv or .parquet
>>> with patch.dict(sys.modules, {"pyarrow": None}):
...     write_table(mm.to_table(run), Path("run.parquet"))
MissingExtra: pyarrow is not installed: pip install "magmotor[parquet]"

# The scene in the attributes
>>> run = disks()
>>> told = json.loads(run.attrs["scene_fields"])
>>> def other(**fields):
...     return run.assign_attrs(scene_fields=json.dumps(told | fields))
>>> mm.scene_of(run.assign_attrs(scene="Pendulum"))
InputError: scene = 'Pendulum' in the dataset's attributes: must be one of ['Disk', ...]; import
    the module that defines the scene class first
>>> mm.scene_of(run.assign_attrs(scene=None))
InputError: scene = None in the dataset's attributes: must be one of ['Disk', ...]; import the
    module that defines the scene class first
>>> mm.scene_of(run.assign_attrs(scene_fields="["))
ArgumentError: attributes['scene_fields'] = '[': must be a JSON object
>>> mm.scene_of(run.assign_attrs(scene_fields="[]"))
ArgumentError: attributes['scene_fields'] = '[]': must be a JSON object
>>> mm.scene_of(other(wind=1.0))
ArgumentError: a field in attributes['scene_fields'] = 'wind': must be one of friction, noise,
    potential, x, v, sigma, friction_ratio, drag, rotational_drag, drag_temperature, theta, omega,
    surface
>>> mm.scene_of(other(sigma=None))
ArgumentError: sigma = None: must be a number
>>> mm.scene_of(other(sigma="x"))
ArgumentError: sigma = 'x': must be a number
>>> mm.scene_of(other(potential={}))
ArgumentError: potential = {}: must be one of symmetric, asymmetric, flat, cosine, or pairs (a_k,
    b_k) of Fourier coefficients
>>> mm.scene_of(other(surface=True))
ArgumentError: surface = True: must be one of planar, plane
>>> del told["sigma"]
>>> mm.scene_of(other())
ArgumentError: attributes['scene_fields'] = {'friction': 0.1, 'noise': 5.0, 'potential':
    'symmetric', 'x': 0.0, 'v': 1.0, 'friction_ratio': 0.0, 'drag': 0.0, 'rotational_drag': 0.0,
    'drag_temperature': None, 'theta': 0.0, 'omega': 0.0, 'surf...: must be an object with the
    field 'sigma'
>>> del run.attrs["scene_fields"]
>>> mm.scene_of(run)
ArgumentError: attributes['scene_fields'] = None: must be a JSON object
>>> del run.attrs["scene"]
>>> mm.scene_of(run)
InputError: scene = None in the dataset's attributes: must be one of ['Disk', ...]; import the
    module that defines the scene class first

# The other attributes of a run
>>> run = disks()
>>> mm.rerun(run.assign_attrs(method="variational/nothing"))
ArgumentError: method = 'variational/nothing': must be one of variational/euler,
    variational/verlet, variational/baoab, variational/middle, mujoco/euler, mujoco/implicitfast,
    mujoco/rk4, mujoco/baoab (did you mean 'variational/baoab'?)
>>> mm.rerun(run.assign_attrs(timestep="0.05"))
ArgumentError: timestep = '0.05': must be a number
>>> mm.rerun(run.assign_attrs(timestep=1e9))
ArgumentError: duration = 3.0: must be at least 1e+09
>>> mm.rerun(run.assign_attrs(duration=1e-12))
ArgumentError: duration = 1e-12: must be at least 0.01
>>> mm.rerun(run.assign_attrs(record_interval=1.0))
ArgumentError: record_interval = 1.0: must be an integer
>>> mm.rerun(run.assign_attrs(seed=2**53))
ArgumentError: seed = 9007199254740992: must be less than 2^53 = 9007199254740992
>>> mm.rerun(run.assign_attrs(path='{"seed": 3}'))
ArgumentError: attributes['path'] = {'seed': 3}: must be an object with the field 'timestep'
>>> told = {"seed": 3, "timestep": 0.1, "level": 40, "factor": 1, "hold": 1, "window": 1}
>>> mm.rerun(run.assign_attrs(path=json.dumps(told)))
ArgumentError: level = 40: must be at most 31
>>> mm.rerun(run.assign_attrs(path=json.dumps(told | {"level": 0, "factor": 2**53})))
ArgumentError: factor = 9007199254740992: must be at most 16777216
>>> mm.rerun(run.assign_attrs(path=json.dumps(told | {"level": 0, "more": 1})))
ArgumentError: a field in attributes['path'] = 'more': must be one of seed, timestep, factor,
    level, hold, window
>>> path_of({"timestep": 0.1})
ArgumentError: seed = None: must be an integer
>>> path_of({"seed": 3})
ArgumentError: timestep = None: must be a number
>>> path_of({"seed": "3", "timestep": 0.1})
ArgumentError: seed = '3': must be an integer
>>> path_of({"seed": 3, "timestep": np.nan})
ArgumentError: timestep = nan: must be a finite number

# Programs of the paper
>>> exponential_test([1.0, 2.0], [False, True], [3.0, 3.0], {})
ArgumentError: number of durations completed = 1: must be at least 2 and at least half of all
>>> exponential_test([1.0, 2.0], [False, False], [3.0, 1.0], {})
ArgumentError: largest duration over its limit = 2.0: must be at most 1
>>> bracket(lambda _: False, 1.0, 2.0, 1.1)
ValueError: first = 1: the condition must hold there
>>> bracket(lambda _: True, 1.0, 2.0, 1.1)
ValueError: last = 2: the condition must fail there
>>> rotor(0.1, 1.0, [0.0, 2.0, 2.0], 1, 0)
ArgumentError: smallest step of times = 0.0: must be greater than 0 s
>>> rotor(0.1, 1.0, [0.0, 2.0, 1.0], 1, 0)
ArgumentError: smallest step of times = -1.0: must be greater than 0 s
>>> lift_map(mm.Top(), np.array([[0.01, np.nan]]))
InputError: points contains nan: every value must be finite and at most 1e+30 in magnitude
>>> largest_lift_map(mm.Top(), np.array([[0.01, np.nan]]))
InputError: points contains nan: every value must be finite and at most 1e+30 in magnitude
>>> held_axis(mm.Top(), np.array([[0.01, np.nan]]))
InputError: points contains nan: every value must be finite and at most 1e+30 in magnitude
>>> Claim("a", "1", None, (), "")
ValueError: claim 'a' has verdict = None and repeats = '': it must have one of them
>>> Claim("a", "1", "right", (), "other")
ValueError: claim 'a' has verdict = 'right' and repeats = 'other': it must have one of them
"""
