"""Runs: their arguments, how they end, recommendations, and theory."""

import importlib
import socket
import sys
from contextlib import ExitStack, contextmanager, suppress
from typing import Any
from unittest.mock import patch

import made_up_charts

import magmotor as mm

# isort: split
# MuJoCo comes after magmotor, which selects the OpenGL backend that MuJoCo loads.
import mujoco
import numpy as np
import xarray as xr

from magmotor import theory
from magmotor.common.environment import data_folder
from magmotor.device import Device, Scene, register
from magmotor.device import device as protocol
from magmotor.live import LiveSimulation, Loop, WebView, live_scene
from magmotor.run import chart_data

SHORT: dict[str, Any] = {"method": "mujoco/rk4", "timestep": 0.025, "duration": 1.0}
DISK: dict[str, Any] = {"method": "variational/euler", "timestep": 0.01, "duration": 10.0}
MOTOR: dict[str, Any] = {
    "method": "variational/baoab",
    "timestep": 0.1,
    "duration": 1.0,
    "replicas": 2,
}
MANY: dict[str, Any] = {
    "method": "variational/baoab",
    "timestep": 0.05,
    "duration": 60.0,
    "replicas": 150,
}
ROTOR: dict[str, Any] = {"method": "variational/baoab", "timestep": 0.01, "duration": 2.0}
QUIET: dict[str, Any] = {"alpha_ball": 0.0, "alpha_ring": 0.0}
HEAVY = mm.Top(center_of_mass=(1e-4, 0, 0))
SKEW = mm.Top(products_of_inertia=(0, 1e-6, 0))


def top(**changes):
    """Simulate a top for 40 steps, with other arguments."""
    return mm.simulate(mm.Top(), **(SHORT | changes))


def motor(**initial):
    """Simulate two motors for ten steps from parts of an initial state."""
    return mm.simulate(mm.Motor(), initial=initial, **MOTOR)


def disk(**changes):
    """Simulate a disk for 1000 steps, with other arguments."""
    return mm.simulate(mm.Disk(), **(DISK | changes))


def disks(**changes):
    """Simulate an ensemble of warm disks, with other arguments."""
    warm = mm.Disk(sigma=0.5, friction=0.5, noise=1.0)
    arguments: dict[str, Any] = {**MANY, "seed": 2, "sample_interval": 10, **changes}
    return mm.ensemble(warm, **arguments)


def recommend(scene=None, **asked):
    """Recommend by charts that are made up."""
    with patch.object(chart_data, "load", lambda: made_up_charts.TABLE):
        return mm.recommend(mm.Top.paper(4) if scene is None else scene, **asked)


def own_device():
    """Import a device outside of the package, registered from now on."""
    sys.modules.pop("own_device", None)
    with patch.object(sys, "path", [str(data_folder("examples")), *sys.path]):
        own = importlib.import_module("own_device")
    del sys.modules["own_device"]
    return own


@contextmanager
def last_port_taken():
    """Take the last port, unless somebody has."""
    with ExitStack() as stack:
        with suppress(OSError):
            stack.enter_context(socket.create_server(("127.0.0.1", 65535)))
        yield


def driven(kind='type="hinge"', body="0 0 -2 0 0 0", joint="0 2", room=5):
    """Compile a model with Brownian wrenches on a body and a potential on a joint."""
    geom, size = '<geom size="0.1"/>', f'<size nuserdata="{room}"/>'
    name = '<custom><text name="magmotor" data="all"/></custom>'
    tree = f'<body name="b" user="{body}"><joint name="j" {kind} user="{joint}"/>{geom}</body>'
    xml = f"<mujoco>{size}{name}<worldbody>{tree}</worldbody></mujoco>"
    return mujoco.MjModel.from_xml_string(xml)


TABLE = r"""
# Names of arguments
>>> mm.simulate(mm.Top())
TypeError: simulate() needs duration=...
>>> mm.simulate(mm.Top(), 60)
TypeError: simulate() takes scene and was given 2 values; name the others, as in method=...
>>> mm.simulate(mm.Top(), durations=60)
TypeError: simulate() has no argument 'durations' (did you mean 'duration'?)
>>> mm.simulate("top", **SHORT)
ArgumentError: scene = 'top': must be an instance of magmotor.Disk, ...
>>> mm.ensemble(mm.Top())
ArgumentError: scene = Top(...): a Top has no noise, and all replicas would be the same: use
    simulate
>>> mm.ensemble(mm.Motor())
TypeError: ensemble() needs method=..., timestep=..., duration=... and replicas=...
>>> mm.Tops
AttributeError: module 'magmotor' has no attribute 'Tops' (did you mean 'Top'?)

# Arguments of a run
>>> top(method="mujoco/rk45")
ArgumentError: method = 'mujoco/rk45': must be one of variational/euler, variational/cayley,
    variational/verlet, variational/baoab, variational/middle, variational/blanes-moan4,
    variational/blanes-moan6, mujoco/euler, mujoco/implicitfast, mujoco/rk4, mujoco/baoab,
    scipy/dop853 (did you mean 'mujoco/rk4'?)
>>> top(method="euler")
ArgumentError: method = 'euler': must be one of variational/euler, variational/cayley,
    variational/verlet, variational/baoab, variational/middle, variational/blanes-moan4,
    variational/blanes-moan6, mujoco/euler, mujoco/implicitfast, mujoco/rk4, mujoco/baoab,
    scipy/dop853 (did you mean 'variational/euler' or 'mujoco/euler'?)
>>> top(method="rk4")
ArgumentError: method = 'rk4': must be one of variational/euler, variational/cayley,
    variational/verlet, variational/baoab, variational/middle, variational/blanes-moan4,
    variational/blanes-moan6, mujoco/euler, mujoco/implicitfast, mujoco/rk4, mujoco/baoab,
    scipy/dop853 (did you mean 'mujoco/rk4'?)
>>> top(timestep=0)
ArgumentError: timestep = 0: must be greater than 0 s
>>> top(timestep=float("nan"))
ArgumentError: timestep = nan: must be a finite number
>>> top(duration=0.01)
ArgumentError: duration = 0.01: must be at least 0.025 s (one timestep)
>>> top(duration=float("inf"))
ArgumentError: duration = inf: must be a finite number
>>> top(seed=-1)
ArgumentError: seed = -1: must be at least 0
>>> top(seed=1.5)
ArgumentError: seed = 1.5: must be an integer
>>> top(replicas=3)
ArgumentError: replicas = 3: must be None: without noise all replicas are the same
>>> top(record_interval=0)
ArgumentError: record_interval = 0: must be at least 1
>>> top(record_interval=41)
ArgumentError: record_interval = 41: must be at most 40 steps
>>> top(timestep=0.001, duration=1e12)
ArgumentError: record_interval = 1: must be at least ... for so long a duration: the records would
    take 1.36e+17 of ... bytes of memory
>>> disk(replicas=0)
ArgumentError: replicas = 0: must be at least 1
>>> path = mm.noise.BrownianPath(9, 0.02)
>>> disk(path=path)
ArgumentError: path.timestep = 0.02: must equal the timestep, 0.01

# Methods that a scene has
>>> mm.simulate(mm.Top(surface="plane"), method="scipy/dop853", timestep=0.1, duration=1)
ArgumentError: method = 'scipy/dop853': must be one of mujoco/euler, mujoco/implicitfast,
    mujoco/rk4
>>> mm.simulate(HEAVY, method="variational/verlet", timestep=0.01, duration=1)
ArgumentError: method = 'variational/verlet': cannot have center_of_mass = (0.0001, 0.0, 0.0):
    must be one of mujoco/euler, mujoco/implicitfast, mujoco/rk4, scipy/dop853
>>> mm.simulate(HEAVY, method="variational/verle", timestep=0.01, duration=1)
ArgumentError: method = 'variational/verle': must be one of mujoco/euler, mujoco/implicitfast,
    mujoco/rk4, scipy/dop853
>>> mm.simulate(SKEW, method="mujoco/baoab", timestep=0.01, duration=1)
ArgumentError: method = 'mujoco/baoab': cannot have products_of_inertia = (0.0, 1e-06, 0.0): must
    be one of mujoco/euler, mujoco/implicitfast, mujoco/rk4, scipy/dop853
>>> mm.recommend(SKEW, method="mujoco/baoab")
ArgumentError: method = 'mujoco/baoab': cannot have products_of_inertia = (0.0, 1e-06, 0.0): must
    be one of mujoco/euler, mujoco/implicitfast, mujoco/rk4, scipy/dop853
>>> mm.simulate(mm.Motor(), method="scipy/dop853", timestep=0.1, duration=1)
ArgumentError: method = 'scipy/dop853': must be one of variational/euler, variational/cayley,
    variational/verlet, variational/baoab, variational/middle, mujoco/euler, mujoco/implicitfast,
    mujoco/rk4, mujoco/baoab
>>> disk(method="scipy/dop853")
ArgumentError: method = 'scipy/dop853': must be one of variational/euler, variational/verlet,
    variational/baoab, variational/middle, mujoco/euler, mujoco/implicitfast, mujoco/rk4,
    mujoco/baoab
>>> loaded = mm.Motor(load_torque=1e-6)
>>> mm.simulate(loaded, method="mujoco/baoab", timestep=0.1, duration=10)
ArgumentError: method = 'mujoco/baoab': cannot have load_torque = 1e-06: must be one of
    variational/euler, variational/cayley, variational/verlet, variational/baoab,
    variational/middle
>>> mm.build(loaded)
ArgumentError: load_torque = 1e-06: must be zero in MuJoCo, which has no force around an axis; use
    another engine
>>> mm.build(mm.LangevinParticle())
ArgumentError: scene = LangevinParticle(friction=0.1, noise=5.0, potential='symmetric', x=0.0,
    v=0.0): a LangevinParticle has no MuJoCo model

# Timesteps beyond a limit
>>> top(method="mujoco/euler", timestep=0.3)
ArgumentError: timestep = 0.3: must be less than 0.1011, the linear limit: beyond it, the smallest
    motion about rest grows
>>> plane = mm.Top(surface="plane")
>>> mm.simulate(plane, method="mujoco/euler", timestep=0.05, duration=1)
ArgumentError: timestep = 0.05: must be less than 0.0414214 s on a plane that bears the ball
>>> mm.simulate(plane, method="mujoco/rk4", timestep=0.15, duration=1)
ArgumentError: timestep = 0.15: must be less than 0.13925 s on a plane that bears the ball
>>> mm.simulate(mm.Motor(), **(MOTOR | {"timestep": 3.0, "duration": 30.0}))
ArgumentError: timestep = 3.0: must be less than 2.283, the linear limit: beyond it, the smallest
    motion about rest grows
>>> disk(timestep=2.0)
ArgumentError: timestep = 2.0: must be less than 1.881, the linear limit: beyond it, the smallest
    motion about rest grows
>>> mm.simulate(mm.Disk(friction=1.0), **(DISK | {"timestep": 0.7}))
ArgumentError: timestep = 0.7: must be less than 0.6421, the linear limit: beyond it, the smallest
    motion about rest grows
>>> mm.simulate(mm.Disk(drag=50.0), **(DISK | {"timestep": 0.05}))
ArgumentError: timestep = 0.05: must be less than 0.0399, the linear limit: beyond it, the
    smallest motion about rest grows

# Scenes that cannot be run
>>> floor = mm.Top.paper(4, tilt=0.0, floor_tilt=(0.2, 0))
>>> mm.simulate(floor, method="mujoco/rk4", timestep=0.01, duration=1)
ArgumentError: floor_tilt = (0.2, 0.0): must be less steep: V_e has no minimum within 1.5 ring
    radii of the center
>>> mm.observables.minimum(mm.Top.experiment(floor_tilt=(1e-3, 0)))
ArgumentError: floor_tilt = (0.001, 0.0): must be less steep: V_e has no minimum within 1.5 ring
    radii of the center
>>> mm.observables.saddle(mm.Top(tilt=0.0, ring_height=0.6))
InputError: ring_height = 0.6: V_e has no saddle under such a high ring
>>> mm.simulate(mm.Motor(**QUIET), **MOTOR)
ArgumentError: replicas = 2: must be None: without noise all replicas are the same

# The initial state of a top
>>> top(initial={"speed": (1, 2)})
ArgumentError: initial = 'speed': must be one of position, velocity, axis, angular_velocity,
    orientation
>>> top(initial={"position": (1,)})
ArgumentError: initial['position'] = (1,): must be 3 finite numbers
>>> top(initial={"position": (np.nan, 0)})
InputError: initial['position'] contains nan: every value must be finite and at most 1e+30 in
    magnitude
>>> top(initial={"velocity": (0, 0, 1)})
ArgumentError: initial['velocity'] = (0, 0, 1): must have z = 0 on the plane
>>> top(initial={"axis": (0, 0, 0)})
ArgumentError: initial['axis'] = (0, 0, 0): must not be zero
>>> top(initial={"axis": (0, 0, 1), "orientation": (1, 0, 0, 0)})
ArgumentError: initial = ['axis', 'orientation']: must have axis or orientation, not both
>>> top(initial=7)
ArgumentError: initial = 7: must be an instance of collections.Mapping or xarray.Dataset
>>> top(initial="x")
ArgumentError: initial = 'x': must be an instance of collections.Mapping or xarray.Dataset
>>> top(initial=[1.0])
ArgumentError: initial = [1.0]: must be an instance of collections.Mapping or xarray.Dataset
>>> top(initial={3: 1.0})
ArgumentError: initial = 3: must be one of position, velocity, axis, angular_velocity, orientation

# The initial states of two motors
>>> motor(speed=1.0)
ArgumentError: initial = 'speed': must be one of position, velocity, axis, angular_velocity,
    orientation, ring_axis, ring_angular_velocity, ring_orientation
>>> motor(position=(0.5, 0.0, 0.1))
ArgumentError: initial['position'] = (0.5, 0.0, 0.1): must have z = 0.04 on the plane
>>> motor(position=((0.5, 0, 0.04), (0.5, 0, 0.1)))
ArgumentError: initial['position'] = ((0.5, 0, 0.04), (0.5, 0, 0.1)): must have z = 0.04 on the
    plane
>>> motor(velocity=(0.0,))
ArgumentError: initial['velocity'] = (0.0,): must be 3 finite numbers, or 2 rows of them
>>> motor(velocity=(0.0, 0.0, 0.1))
ArgumentError: initial['velocity'] = (0.0, 0.0, 0.1): must have z = 0 on the plane
>>> motor(velocity=np.zeros((3, 3)))
ArgumentError: initial['velocity'] = array([[0., 0., 0.], [0., 0., 0.], [0., 0., 0.]]): must be 3
    finite numbers, or 2 rows of them
>>> motor(angular_velocity=(0, np.nan, 0))
InputError: initial['angular_velocity'] contains nan: every value must be finite and at most 1e+30
    in magnitude
>>> motor(axis=(0, 0, 1), orientation=(1, 0, 0, 0))
ArgumentError: initial = ['axis', 'orientation']: must have axis or orientation, not both
>>> motor(ring_axis=(0, 0, 0))
ArgumentError: initial['ring_axis'] = (0, 0, 0): must not be zero
>>> motor(ring_axis=(0.4, 0, 1))
ArgumentError: initial['ring_axis'] = [[0.3713..., 0.0, 0.9284...], [0.3713..., 0.0, 0.9284...]]:
    must be within 20 degrees of the vertical
>>> motor(ring_axis=((0, 0, 1), (0.4, 0, 1)))
ArgumentError: initial['ring_axis'] = [[0.0, 0.0, 1.0], [0.3713..., 0.0, 0.9284...]]: must be
    within 20 degrees of the vertical
>>> motor(ring_orientation=(0, 1, 0, 0))
ArgumentError: initial['ring_axis'] = [[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]]: must be within 20
    degrees of the vertical
>>> motor(ring_axis=(0, 0, 1), ring_orientation=(1, 0, 0, 0))
ArgumentError: initial = ['ring_axis', 'ring_orientation']: must have ring_axis or
    ring_orientation, not both

# The initial state of a disk
>>> disk(initial={"z": 1.0})
ArgumentError: initial = 'z': must be one of x, v, theta, omega
>>> disk(initial={"x": (1.0, 2.0)})
ArgumentError: initial['x'] = (1.0, 2.0): must be a finite number or 1 of them
>>> disk(initial={"x": "north"})
ArgumentError: initial['x'] = 'north': must be an array of numbers
>>> disk(initial={"x": [[1.0], [1.0, 2.0]]})
ArgumentError: initial['x'] = [[1.0], [1.0, 2.0]]: must be an array of numbers
>>> disk(initial={"x": True})
ArgumentError: initial['x'] = True: must be an array of numbers
>>> disk(initial={"x": 1j})
ArgumentError: initial['x'] = 1j: must be an array of numbers
>>> disk(initial={"v": np.nan})
InputError: initial['v'] contains nan: every value must be finite and at most 1e+30 in magnitude
>>> disk(initial={"v": [1e60]})
InputError: initial['v'] contains 1e+60: every value must be finite and at most 1e+30 in magnitude

# Runs that continue others
>>> run = mm.simulate(mm.Disk(), replicas=3, **DISK)
>>> disk(replicas=2, initial=run.isel(replica=[1, 2]))
ArgumentError: initial.replica = [1, 2]: must be 0, 1, 2, ... to continue their Brownian paths; or
    use another seed
>>> disk(replicas=3, initial=run.drop_vars("x"))
ArgumentError: initial = ['v', 'theta', 'omega', 'energy']: the dataset must also have x
>>> disk(replicas=3, initial=run.isel(time=0))
ArgumentError: initial.x = ('replica',): must have a dimension time, as in a run
>>> disk(replicas=3, initial=run.isel(time=slice(0)))
ArgumentError: number of records in initial = 0: must be at least 1
>>> disk(replicas=2, initial=run.isel(replica=[0]))
ArgumentError: initial['x'] = array([7.4974488]): must be a finite number or 2 of them
>>> disk(replicas=3, initial=run.drop_vars("time"))
ArgumentError: initial = ['replica', 'step']: must be a dataset with the coordinate time
>>> disk(replicas=3, initial=run.assign_coords(step=-run.step - 1))
ArgumentError: initial.step = -1001: must be at least 0
>>> disk(replicas=3, initial=run.drop_vars("step").assign_coords(time=-run.time.values))
ArgumentError: initial.time = -10.0: must be at least 0
>>> disk(replicas=3, initial=run.assign(x=run.x * np.nan))
InputError: initial['x'] contains nan: every value must be finite and at most 1e+30 in magnitude
>>> disk(replicas=3, initial=run.astype(str))
ArgumentError: initial['x'] = array(['7.497448796302001', '-0.7372040813051288',
    '-38.32630265372784'], dtype='<U32'): must be an array of numbers
>>> disk(replicas=3, initial=run.drop_vars("step").assign_attrs(first_step="x"))
ArgumentError: attributes['first_step'] = 'x': must be an integer
>>> disk(replicas=3, initial=run.drop_vars("step").assign_attrs(first_step=-1))
ArgumentError: attributes['first_step'] = -1: must be at least 0
>>> disk(replicas=3, initial=run.drop_vars("step").assign_attrs(first_step=2**53))
ArgumentError: duration = 10.0: must be so short that the Brownian path has fewer than 2^53 steps

# Arguments of an ensemble
>>> disks(method="scipy/dop853")
ArgumentError: method = 'scipy/dop853': must be one of variational/euler, variational/verlet,
    variational/baoab, variational/middle, mujoco/euler, mujoco/implicitfast, mujoco/rk4,
    mujoco/baoab
>>> disks(method="mujoco/baoab", threads=2)
ArgumentError: threads = 2: must be left out, since MuJoCo uses all processors
>>> disks(replicas=0)
ArgumentError: replicas = 0: must be at least 1
>>> disks(trajectories=151)
ArgumentError: trajectories = 151: must be at most 150, the number of replicas
>>> disks(threads=0)
ArgumentError: threads = 0: must be at least 1
>>> disks(timestep=0.0)
ArgumentError: timestep = 0.0: must be greater than 0
>>> disks(timestep=3.0, duration=1e3)
ArgumentError: timestep = 3.0: must be less than 2, the linear limit: beyond it, the smallest
    motion about rest grows
>>> disks(duration=1.0)
ArgumentError: duration = 1.0: must be at least 2 (4 sample intervals)
>>> disks(burn_in=59.0)
ArgumentError: burn_in = 59.0: must be at most 58 (4 sample intervals before the end)
>>> disks(burn_in=-1.0)
ArgumentError: burn_in = -1.0: must be at least 0
>>> disks(sample_interval=0)
ArgumentError: sample_interval = 0: must be at least 1
>>> disks(seed=-1)
ArgumentError: seed = -1: must be at least 0
>>> disks(initial={"x": [1.0, 2.0]})
ArgumentError: initial['x'] = [1.0, 2.0]: must be a finite number or 150 of them
>>> mm.ensemble(mm.Disk(noise=0.0), **MANY)
ArgumentError: noise = 0.0: must be positive, or all replicas would be the same
>>> mm.ensemble(mm.Top(), method="variational/euler", timestep=0.01, duration=1.0, replicas=2)
ArgumentError: scene = Top(...): a Top has no noise, and all replicas would be the same: use
    simulate

# Warnings and ends of runs
>>> disk(timestep=0.06)
UserWarning: timestep = 0.06: above 0.0574 = (pi/6) sqrt((1 + sigma) beta), the largest safe one;
    long flights are aliased, since a step in which x moves by a period of U looks like rest
>>> disk(method="variational/baoab", timestep=1.0, duration=5.0)
UserWarning: timestep = 1: above 0.0574 = (pi/6) sqrt((1 + sigma) beta), the largest safe one;
    long flights are aliased, since a step in which x moves by a period of U looks like rest
>>> disk(timestep=1.5, duration=3e6, record_interval=1000, replicas=32)
UserWarning: timestep = 1.5: above 0.0574 = (pi/6) sqrt((1 + sigma) beta), the largest safe one;
    long flights are aliased, since a step in which x moves by a period of U looks like rest
SimulationDiverged: variational/euler with timestep 1.5 stopped at t = ...: energy grew beyond
    what the motion can have
>>> level = mm.Top.paper(4, axis=(1.0, 0.0, 0.2))
>>> long = {"method": "variational/cayley", "timestep": 2.0, "duration": 2e3}
>>> mm.simulate(level, **long, allow_unstable=True)
SimulationDiverged: variational/cayley with timestep 2 s stopped at t = ... s: a value is not
    finite, or huge
>>> top(timestep=0.25, duration=60, allow_unstable=True)
SimulationDiverged: mujoco/rk4 with timestep 0.25 s stopped at t = ... s: energy grew beyond what
    the motion can have
>>> mm.simulate(mm.Top.si(), method="mujoco/rk4", timestep=0.001, duration=60)
PhysicalEvent: mujoco/rk4 with timestep 0.001 s stopped at t = ... s: the magnetic lift, 1.98 N,
    exceeds the ball's weight, 1.96 N, and the plane cannot hold it down: use a larger gravity or
    surface = 'plane'
>>> level = mm.Top.paper(4, tilt=0.0, floor_tilt=(0.01, 0), velocity=(1.0, 0.0))
>>> mm.simulate(level, method="mujoco/rk4", timestep=0.02, duration=10)
PhysicalEvent: mujoco/rk4 with timestep 0.02 s stopped at t = ... s: the ball is 0.5150 m from the
    center, beyond 0.5100 m, where no ring holds it
>>> rolling = mm.Motor(floor_tilt=(8e-5, 0), velocity=(0.1, 0.0))
>>> mm.simulate(rolling, method="mujoco/baoab", timestep=0.1, duration=100, seed=1)
PhysicalEvent: mujoco/baoab with timestep 0.1 s stopped at t = ... s: the ball is 1.4753 m from
    the center, beyond 1.4700 m, where no ring holds it
>>> loaded = mm.Motor(load_torque=1e-4, **QUIET)
>>> mm.simulate(loaded, method="variational/middle", timestep=0.1, duration=1000)
PhysicalEvent: variational/middle with timestep 0.1 s stopped at t = ... s: the ball is 1.4702 m
    from the center, beyond 1.4700 m, where no ring holds it
>>> warm = mm.Motor(temperature="nonuniform", alpha_ring=0.02)
>>> mm.simulate(warm, method="mujoco/euler", timestep=0.025, duration=2000, seed=1)
PhysicalEvent: mujoco/euler with timestep 0.025 s stopped at t = ... s: the inner ring is lost: it
    is tilted by 20.1 degrees, beyond 20
>>> swing = {"center_of_mass": (0.015, 0, 0), "axis": (0, 1, 0), "spin": 40.0, "coupling": 1e-30}
>>> swing |= {"ball_inertia": 5e-5, "ball_axial_inertia": 5e-5, "friction": 0.0}
>>> lifted = mm.Top(ring_height=1.0, position=(0, 0), **swing)
>>> numbers = {"method": "mujoco/rk4", "timestep": 1e-3, "duration": 0.2, "allow_unstable": True}
>>> mm.simulate(lifted, **numbers)
PhysicalEvent: mujoco/rk4 with timestep 0.001 s stopped at t = ... s: the plane cannot hold the
    ball down, which its swinging mass and the magnets lift by 0.0371 N

# The first law
>>> light = {"temperature": "nonuniform", "friction_ring": 0.15, "inner_mass": 1.0}
>>> motor = mm.Motor(ball_ring_factor=1.0, **light, alpha_ball=1e-5, alpha_ring=4e-5)
>>> cold = motor.replace(alpha_ball=0.0, alpha_ring=0.0)
>>> rest = mm.simulate(cold, method="variational/baoab", timestep=0.8, duration=2e4)
>>> given = {"timestep": 0.8, "duration": 400.0, "record_interval": 50, "seed": 4}
>>> mm.simulate(motor, method="variational/euler", replicas=64, initial=rest, **given)
UserWarning: timestep = 0.8: variational/euler has added 2.5e-09 J, 16% of the heat, so that the
    first law does not hold: use a shorter timestep

# Runs made again
>>> state = {"v": np.array([0.5, 0.6])}
>>> numbers = {"timestep": 0.05, "duration": 5.0, "record_interval": 3, "replicas": 2}
>>> run = mm.simulate(mm.Disk(), method="variational/baoab", initial=state, **numbers)
>>> mm.rerun(run.isel(time=slice(3, None)))
ArgumentError: time = '0.45 to 4.95': must be the times of a run's records, complete from the
    start
>>> mm.rerun(run.isel(time=slice(None, None, 2)))
ArgumentError: time = '0 to 4.8': must be the times of a run's records, complete from the start
>>> mm.rerun(run.isel(time=slice(0)))
ArgumentError: number of records in run = 0: must be at least 1
>>> mm.rerun(xr.concat([run, run], "time"))
ArgumentError: time = '0 to 4.95': must be the times of a run's records, complete from the start
>>> mm.rerun(xr.concat([run, run], "seed"))
ArgumentError: dimensions = ['seed', 'replica', 'time']: must be those of one run
>>> mm.rerun(run.isel(replica=0))
ArgumentError: replica = None: must be 2, the number `replicas` in the attributes
>>> mm.rerun(run.astype("f4"))
ArgumentError: x.dtype = 'float32': must be float64, since the run did not start from the scene's
    own initial state
>>> mm.rerun(run.drop_vars("omega"))
ArgumentError: initial = ['x', 'v', 'theta', 'energy']: the dataset must also have omega
>>> mm.rerun(run.drop_attrs())
ArgumentError: attributes = []: must be those of a run or an ensemble; scene, scene_fields,
    method, timestep, duration, record_interval, seed are missing
>>> mm.rerun(run.assign_attrs(scene="Pendulum"))
InputError: scene = 'Pendulum' in the dataset's attributes: must be one of ['Disk', ...]; import
    the module that defines the scene class first
>>> mm.rerun(xr.Dataset({"x": 1.0}))
ArgumentError: attributes = []: must be those of a run or an ensemble; scene, scene_fields,
    method, timestep, duration, record_interval, seed are missing
>>> mm.rerun(run, measures=["flights"])
ArgumentError: measures = ['flights']: must be empty: this dataset is not a sweep
>>> initial = {"velocity": (0.01, 0.0)}
>>> many = mm.ensemble(mm.Motor(), initial=initial, **(MOTOR | {"duration": 2.0}))
>>> mm.rerun(many)
ArgumentError: initial = 'not kept': this ensemble cannot be rerun without its initial state

# Recommendations
>>> recommend(error=0)
ArgumentError: error = 0: must be greater than 0 (a fraction: 0.01 is 1 %)
>>> recommend(error=1)
ArgumentError: error = 1: must be less than 1 (a fraction: 0.01 is 1 %)
>>> recommend(error=1e-7)
ArgumentError: error = 1e-07: must be at least 1e-06, the smallest charted for momentum_map
    (mujoco/rk4 at a timestep of 0.05); engine = 'any' considers other engines, too
>>> recommend(error=1e-7, engine="any")
ArgumentError: error = 1e-07: must be at least 1e-06, the smallest charted for momentum_map
    (mujoco/rk4 at a timestep of 0.05)
>>> recommend(error=1e-7, method="mujoco/rk4")
ArgumentError: error = 1e-07: must be at least 1e-06, the smallest charted for momentum_map
    (mujoco/rk4 at a timestep of 0.05)
>>> recommend(mm.Disk(), error=0.0049, engine="any")
ArgumentError: error = 0.0049: must be at least 0.00502, the smallest charted for temperature
    (variational/baoab at a timestep of 0.02)
>>> recommend(timestep=0)
ArgumentError: timestep = 0: must be greater than 0 s
>>> recommend(timestep=0.11)
ArgumentError: timestep = 0.11: must be at most 0.1, the longest in the charts; engine = 'any'
    considers other engines, too
>>> recommend(timestep=0.11, method="mujoco/rk4")
ArgumentError: timestep = 0.11: must be at most 0.1, the longest in the charts
>>> recommend(timestep=0.05, method="variational/euler")
ArgumentError: timestep = 0.05: must be at most 0.04, the longest in the charts
>>> recommend(engine="scipy")
ArgumentError: engine = 'scipy': must be one of mujoco, any
>>> recommend(engine=1)
ArgumentError: engine = 1: must be one of mujoco, any
>>> recommend(quantity="spin")
ArgumentError: quantity = 'spin': must be one of momentum_map, position
>>> mm.recommend(mm.Motor(temperature="nonuniform"), quantity="heat")
ArgumentError: quantity = 'heat': must be one of path, temperature
>>> recommend(method="scipy/dop853")
ArgumentError: method = 'scipy/dop853': must be a method charted for momentum_map:
    variational/euler, variational/baoab, mujoco/rk4
>>> recommend(method="mujoco/euler")
ArgumentError: method = 'mujoco/euler': must be a method charted for momentum_map:
    variational/euler, variational/baoab, mujoco/rk4
>>> recommend(method="mujoco/rk45")
ArgumentError: method = 'mujoco/rk45': must be one of variational/euler, variational/cayley,
    variational/verlet, variational/baoab, variational/middle, variational/blanes-moan4,
    variational/blanes-moan6, mujoco/euler, mujoco/implicitfast, mujoco/rk4, mujoco/baoab,
    scipy/dop853 (did you mean 'mujoco/rk4'?)
>>> recommend("top")
ArgumentError: scene = 'top': must be an instance of magmotor.Disk, ...
>>> recommend(mm.Disk(surface="plane"))
ArgumentError: surface = 'plane': the charts have no Disk on this surface: pass a method and a
    timestep to simulate
>>> recommend(mm.Motor())
ArgumentError: surface = 'planar': the charts have no Motor on this surface: pass a method and a
    timestep to simulate; engine = 'any' considers other engines, too
>>> recommend(mm.Top(surface="plane", coulomb_friction=0.1))
ArgumentError: coulomb_friction = 0.1: the charts have no dry friction, with which the error
    depends on the coefficient more than on the timestep: pass a method and a timestep to simulate

# Recommendations that are measured
>>> mm.recommend(mm.Top.paper(4), method="variational/baoab", measure=True)
ArgumentError: method = 'variational/baoab': must be one of mujoco/euler, mujoco/rk4,
    mujoco/implicit, mujoco/implicitfast, mujoco/discrete
>>> mm.recommend(mm.Disk(), quantity="path", measure=True)
ArgumentError: quantity = 'path': must be left out if measure = True
>>> mm.recommend(mm.Disk(), timestep=0.1, measure=True)
ArgumentError: timestep = 0.1: must be left out if measure = True
>>> mm.recommend(mm.Disk(), engine="any", measure=True)
ArgumentError: engine = 'any': must be 'mujoco' if measure = True
>>> mm.recommend(mm.Disk(), method="mujoco/heun", measure=True)
ArgumentError: method = 'mujoco/heun': must be one of variational/euler, variational/verlet,
    variational/baoab, variational/middle, mujoco/euler, mujoco/implicitfast, mujoco/rk4,
    mujoco/baoab (did you mean 'mujoco/euler'?)

# Theory of disks
>>> mm.theory.gibbs(mm.Disk(noise=0.0), 3)
ArgumentError: noise = 0.0: must be positive, since the temperature is zero without it
>>> mm.theory.gibbs(mm.LangevinParticle(), 3, d=1.0)
ArgumentError: d = 1.0: must be None, since a Langevin particle does not rotate
>>> mm.theory.gibbs(mm.Disk(potential="asymmetric", noise=1e-5), 1)
ArgumentError: noise = 1e-05: must be so large that beta max|U''| is at most 1e+06
>>> theory.y_diffusion(mm.Disk(friction_ratio=0.2))
ArgumentError: friction_ratio = 0.2: must be zero for this closed form
>>> theory.ReducedDisk(mm.Disk(noise=0.0))
ArgumentError: noise = 0.0: must be greater than 0
>>> theory.d_diffusion(mm.Disk(noise=0.0), 1.0)
ArgumentError: noise = 0.0: must be greater than 0
>>> theory.position_cdf(mm.Disk(noise=0.0), 1.0)
ArgumentError: noise = 0.0: must be greater than 0
>>> theory.ReducedDisk(mm.Disk(), 3)
ArgumentError: cells = 3: must be at least 10
>>> theory.ReducedDisk(mm.Disk()).d_correlation([0, 1])
ArgumentError: t[0] = 0.0: must be greater than 0
>>> theory.alias_period(mm.Disk(), 0)
ArgumentError: timestep = 0: must be greater than 0
>>> theory.flat_msd_from_gibbs(mm.Disk(), 1.0, (1,))
ArgumentError: direction = array([1.]): must be 2 numbers
>>> theory.euler_slip_variance(mm.Disk(), 7)
ArgumentError: timestep = 7.0: must be less than 6.66667

# Theory of disks with drag
>>> two = mm.Disk(drag=0.02, rotational_drag=0.005, drag_temperature=60.0)
>>> warm = mm.Disk(friction=0.5, noise=1.0, drag=0.2, rotational_drag=0.05)
>>> theory.gibbs(two, 10)
ArgumentError: drag_temperature = 60.0: must be None or 125, the disk's kT, for a Gibbs measure
>>> theory.ReducedDisk(two)
ArgumentError: drag_temperature = 60.0: must be None or 125, the disk's kT, for a Gibbs measure
>>> theory.position_density(two, 0)
ArgumentError: drag_temperature = 60.0: must be None or 125, the disk's kT, for a Gibbs measure
>>> theory.flat_msd_from_gibbs(two, 1)
ArgumentError: drag_temperature = 60.0: must be None or 125, the disk's kT, for a Gibbs measure
>>> theory.y_diffusion(warm)
ArgumentError: drag = 0.2: must be zero for this closed form
>>> theory.euler_slip_variance(warm, 0.1)
ArgumentError: drag = 0.2: must be zero for this closed form

# Live simulations
>>> live_scene(mm.LangevinParticle(), timestep=0.01)
ArgumentError: scene = LangevinParticle(friction=0.1, noise=5.0, potential='symmetric', x=0.0,
    v=0.0): a LangevinParticle has no MuJoCo model
>>> LiveSimulation(driven())
>>> LiveSimulation(driven(room=0), seed=3)
ArgumentError: seed = 3: must be 0, since the model has noise but no nuserdata to hold a seed
>>> LiveSimulation(mujoco.MjModel.from_xml_string("<mujoco/>"))
UserWarning: nothing acts on this model: neither a mark nor a site with a user number names
    dipoles
>>> simulation = live_scene(mm.Top(), timestep=0.01)
>>> simulation.data.qvel[0] = np.nan
>>> simulation.advance(1)
StateLost: the state is not finite at t = 0
>>> lifted = live_scene(mm.Top.si(), method="mujoco/euler", timestep=0.01)
>>> lifted.advance(30)
StateLost: the magnetic lift, ... N, exceeds the ball's weight, 1.96 N, and the plane cannot hold
    it down: use a larger gravity or surface = 'plane'
>>> own = own_device()
>>> plain = own.RotorDevice.compose
>>> def compose(self, scene, *, visual):
...     spec = plain(self, scene, visual=visual)
...     spec.delete(spec.keys[0])
...     return spec
>>> own.RotorDevice.compose = compose
>>> live_scene(own.Rotor(), timestep=0.002)
ArgumentError: scene = Rotor(inertia=2e-06, moment=0.5, magnet=20.0, distance=0.2, damping=1e-05,
    kT=2e-05, angle=1.0, rate=0.0): its model must have a keyframe for its initial state, and a
    joint if it has sliders
>>> del protocol.SCENES["Rotor"]
>>> with patch.dict(sys.modules, {"mjviser": None}):
...     mm.live.web(mm.Disk())
MissingExtra: mjviser is not installed: pip install "magmotor[web]"
>>> loop = Loop(live_scene(mm.Disk(), timestep=0.01), 1.0)
>>> with last_port_taken():
...     WebView(loop, port=65535)
ArgumentError: port = 65535: must leave a free port up to 65535; all are taken

# User numbers of bodies and joints
>>> mm.describe(driven(body="1 " * 20))
DeclarationError(wrench, 1): body 1 'b': its user numbers must be rows of six, the Brownian
    wrenches, and finite
>>> mm.describe(driven(joint="0 2 0 0 1"))
DeclarationError(potential, 0): joint 0 'j': its user numbers must be pairs, the finite Fourier
    coefficients of a potential, and the joint must be a slide or a hinge
>>> mm.describe(driven('type="free"', joint="1"))
DeclarationError(potential, 0): joint 0 'j': its user numbers must be pairs, the finite Fourier
    coefficients of a potential, and the joint must be a slide or a hinge

# A device outside of the package
>>> Rotor = own_device().Rotor
>>> mm.simulate(Rotor(), method="mujoco/euler", timestep=0.3, duration=3.0)
ArgumentError: timestep = 0.3: must be less than 0.1433, the linear limit: beyond it, the smallest
    motion about rest grows
>>> mm.simulate(Rotor(kT=0.0), replicas=3, **ROTOR)
ArgumentError: replicas = 3: must be None: without noise (kT = 0) all replicas are the same
>>> mm.ensemble(Rotor(kT=0.0), replicas=2, **ROTOR)
ArgumentError: replicas = 2: must be None: without noise (kT = 0) all replicas are the same
>>> mm.simulate(Rotor(), replicas=0, **ROTOR)
ArgumentError: replicas = 0: must be at least 1
>>> mm.ensemble(Rotor(), replicas=5, burn_in=1.0, **ROTOR)
ArgumentError: burn_in = 1.0: must be left out: ensembles of a Rotor have moments only
>>> mm.rerun(mm.ensemble(Rotor(), replicas=2, initial={"theta": 0.5}, **ROTOR))
ArgumentError: initial = 'not kept': this ensemble cannot be rerun without its initial state
>>> mm.recommend(Rotor())
ArgumentError: scene = Rotor(inertia=2e-06, moment=0.5, magnet=20.0, distance=0.2, damping=1e-05,
    kT=2e-05, angle=1.0, rate=0.0): the charts have no Rotor: pass a method and a timestep to
    simulate
>>> mm.observables.energy_balance(mm.simulate(Rotor(), **ROTOR))
ArgumentError: scene = Rotor(inertia=2e-06, moment=0.5, magnet=20.0, distance=0.2, damping=1e-05,
    kT=2e-05, angle=1.0, rate=0.0): a Rotor has no energy balance
>>> mm.simulate(Rotor(), replicas=2, initial={"theta": np.nan}, **ROTOR)
InputError: initial['theta'] contains nan: every value must be finite and at most 1e+30 in
    magnitude
>>> mm.simulate(Rotor(), replicas=2, initial={"omega": [0, 1e31]}, **ROTOR)
InputError: initial['omega'] contains 1e+31: every value must be finite and at most 1e+30 in
    magnitude
>>> mm.simulate(Rotor(), replicas=2, initial={"theta": "north"}, **ROTOR)
ArgumentError: initial['theta'] = 'north': must be an array of numbers
>>> mm.simulate(Rotor(), replicas=2, initial={"omega": [1, 2, 3]}, **ROTOR)
ArgumentError: initial['omega'] = [1, 2, 3]: must be a finite number or 2 of them
>>> mm.simulate(Rotor(), replicas=2, initial={"theta": [[1, 2]]}, **ROTOR)
ArgumentError: initial['theta'] = [[1, 2]]: must be a finite number or 2 of them
>>> mm.simulate(Rotor(), replicas=2, initial={"phi": 1}, **ROTOR)
ArgumentError: initial = 'phi': must be one of theta, omega
>>> register(Rotor().device, type("Rotor", (Scene,), {"__module__": "elsewhere"}))
ArgumentError: name of the scene class = 'Rotor': own_device has registered a scene class of this
    name
>>> del protocol.SCENES["Rotor"]

# Parts that a device outside of the package lacks
>>> own = own_device()
>>> parts = {"variational": Device.variational, "mujoco": Device.mujoco, "ode": Device.ode}
>>> methods = ("variational/baoab", "mujoco/baoab", "scipy/dop853")
>>> lacking = type("RotorDevice", (own.RotorDevice,), {**parts, "joints": Device.joints})
>>> lacking.methods = lambda self, scene: methods
>>> lacking.check_run = lambda *_: None
>>> run = mm.simulate(own.Rotor(), **ROTOR)
>>> register(lacking(), own.Rotor)
>>> mm.simulate(own.Rotor(), **ROTOR)
ArgumentError: method = 'variational/...': a Rotor needs RotorDevice.variational, which is missing
>>> mm.simulate(own.Rotor(), **(ROTOR | {"method": "mujoco/baoab"}))
ArgumentError: method = 'mujoco/baoab': a Rotor needs RotorDevice.mujoco, which is missing
>>> mm.simulate(own.Rotor(), **(ROTOR | {"method": "scipy/dop853"}))
ArgumentError: method = 'scipy/dop853': a Rotor needs RotorDevice.ode, which is missing
>>> mm.render.movie(run, None, "rotor.mp4")
ArgumentError: scene = Rotor(inertia=2e-06, moment=0.5, magnet=20.0, distance=0.2, damping=1e-05,
    kT=2e-05, angle=1.0, rate=0.0): a Rotor needs RotorDevice.joints, which is missing
>>> del protocol.SCENES["Rotor"]
"""
