"""Every public function rejects invalid arguments by a ValueError that names them."""

import inspect
import math
import re
import warnings
from collections.abc import Callable
from functools import cache
from inspect import isclass
from typing import Any

import mujoco
import numpy as np
import pytest
import xarray as xr
from refusals import refused

import magmotor as mm
from magmotor import live
from magmotor.common.arguments import checked
from magmotor.common.checks import check_array, check_integer, check_number
from magmotor.devices.top.states import start
from magmotor.numerics import linear_stability as linear

TOP, MOTOR, DISK, PARTICLE = mm.Top(), mm.Motor(), mm.Disk(), mm.LangevinParticle()
MODEL = mm.build(DISK)
CONTACT = mm.ViscousContact(0.3, "ball", "floor", bears_load=False)
SWEEP = mm.sweep.Sweep(
    scene=DISK, vary={"noise": [1.0, 2.0]}, measure=["temperature"], duration=1.0, timestep=0.02
)


@cache
def run_of(name) -> xr.Dataset:
    """Return a run of a scene, or an ensemble; made when the first test needs it."""
    if name == "ensemble":
        return mm.ensemble(
            DISK, method="variational/baoab", timestep=0.02, duration=20.0, replicas=8,
            trajectories=8,
        )  # fmt: skip
    scene, timestep, duration = {
        "top": (TOP, 0.01, 0.3), "motor": (MOTOR, 0.1, 10.0), "disk": (DISK, 0.01, 0.3)
    }[name]  # fmt: skip
    return mm.simulate(scene, method="variational/baoab", timestep=timestep, duration=duration)


WRONG = {
    "an object": object(),
    "bytes": b"1",
    "an array of text": np.array("a"),
    "a complex number": 1j,
    "a scene of another class": None,  # depends on the function
    "an empty dataset": xr.Dataset(),
    "a run of another scene": None,
}
"""Values that no argument may have."""

PERHAPS = {
    "nothing": None,
    "a number": 3.5,
    "text": "x",
    "an empty list": [],
    "not a number": math.nan,
    "infinity": math.inf,
    "a subnormal number": 5e-324,
    "a huge number": 1e300,
    "a huge integer": 2**70,
}
"""Values that only some arguments may have."""

STATES = start(TOP)
VECTOR, POINTS = [0.0, 0.0, 0.1], [[0.0, 0.0, 0.0]]
MOTION = mm.theory.small_motion(DISK)
LIVE = live.live_scene(DISK, timestep=0.02)
SCENE_FUNCTIONS = {
    TOP: "field_under_center slip_relaxation_rate highest_valley resting_ball small_motion",
    MOTOR: "ball_injection_rate ring_injection_rate slip_mobility",
    DISK: "ballistic_coefficient flat_x_diffusion friction_rates friction_step_limit"
    " gibbs_deviations gibbs_mean_squares injection_rate largest_timestep potential_step_limit"
    " slip_factor slip_rate temperature"
    " velocity_noise_coefficient y_diffusion DiskTheory ReducedDisk",
}
TOPS, MOTORS, DISKS = (
    lambda name=name, scene=scene: {"run": run_of(name), "scene": scene}
    for name, scene in (("top", TOP), ("motor", MOTOR), ("disk", DISK))
)
TURNING = {"scene": TOP, "angular_velocity": VECTOR}
STEPS: dict[str, Any] = {"method": "variational/baoab", "timestep": 0.02}
DIPOLES = {"position": VECTOR, "moment": VECTOR, "positions": POINTS, "moments": POINTS}
TIMES = {"t": [1.0, 2.0]}

PENDULUM = mujoco.MjModel.from_xml_string("""
<mujoco><worldbody><body>
  <joint axis="0 1 0" damping="1"/><inertial pos="0 0 -1" mass="1" diaginertia="1 1 1"/>
</body></worldbody></mujoco>""")
TOSSED = mujoco.MjData(PENDULUM)
TOSSED.qvel[0] = 1.0
STILL = {
    "model": PENDULUM,
    "run": xr.Dataset({name: (("time", "n"), np.ones((16, 1))) for name in ("qpos", "qvel")}),
}

SPEC = mujoco.MjSpec.from_string("""
<mujoco>
  <worldbody><site name="tip"/><geom name="ball" size="1"/></worldbody>
  <actuator><general name="current" site="tip"/></actuator>
</mujoco>""")

CALLS: dict[Any, dict[str, Any] | Callable[[], dict[str, Any]]] = {
    **{
        getattr(mm.theory, name): {"scene": scene}
        for scene, names in SCENE_FUNCTIONS.items()
        for name in names.split()
    },
    mm.theory.alias_period: {"scene": DISK, "timestep": 0.1},
    mm.theory.d_diffusion: {"scene": DISK, "d": [0.0, 1.0]},
    mm.theory.euler_slip_variance: {"scene": DISK, "timestep": 0.1},
    mm.theory.flat_mean_displacement: {"scene": DISK, **TIMES, "direction": [1.0, 1.0]},
    mm.theory.flat_msd_from_gibbs: {"scene": DISK, **TIMES, "direction": [1.0, 1.0]},
    mm.theory.flat_variance_from_rest: {"scene": DISK, **TIMES, "direction": [1.0, 1.0]},
    mm.theory.heat_rate: {"scene": DISK, "velocities": [1.0, 2.0]},
    mm.theory.largest_stable_step: {"motion": MOTION, "step": linear.euler_step},
    mm.theory.spectral_radius: {"motion": MOTION, "step": linear.euler_step, "h": 0.1},
    mm.theory.libration_frequency: {"scene": TOP, "field": 0.01},
    mm.theory.position_cdf: {"scene": DISK, "x": [1.0]},
    mm.theory.position_density: {"scene": DISK, "x": [1.0]},
    **{
        getattr(mm.theory.ReducedDisk(DISK), name): TIMES
        for name in ("d_correlation", "d_mean_square_from_rest", "msd_from_gibbs", "msd_from_rest",
                     "slope_from_gibbs", "slope_from_rest")
    },
    mm.theory.ReducedDisk(DISK).increment_correlation: {"lag": 1.0},
    mm.theory.DiskTheory(PARTICLE).mean: TIMES,
    mm.theory.DiskTheory(PARTICLE).mean_square: TIMES,
    mm.theory.DiskTheory(PARTICLE).variance: TIMES,
    mm.theory.DiskTheory(PARTICLE).correlation: {"lag": 1.0},
    mm.observables.azimuth: lambda: {"run": run_of("motor")},
    mm.observables.ring_attitude: lambda: {"run": run_of("motor")},
    mm.observables.censored_mean: {"values": [1.0, 2.0], "censored": [False, True]},
    mm.observables.critical_points: {"scene": TOP.replace(tilt=0.3), "time": 0.0},
    mm.observables.minimum: {"scene": TOP, "time": 0.0},
    mm.observables.saddle: {"scene": TOP.replace(tilt=0.3), "time": 0.0},
    mm.observables.valley_radius: {"scene": TOP, "azimuth": 0.0, "time": 0.0},
    mm.observables.effective_potential: {"scene": TOP, "points": [0.1, 0.0], "time": 0.0},
    mm.observables.motor_wells: {"scene": MOTOR},
    mm.observables.d_diffusion: DISKS,
    mm.observables.efficiency: MOTORS,
    mm.observables.flights: MOTORS,
    mm.observables.dwell_times: MOTORS,
    mm.observables.transitions: MOTORS,
    mm.observables.mode_temperatures: lambda: {**MOTORS(), "burn_in": 1.0},
    mm.observables.momentum_balance: TOPS,
    mm.observables.energy_balance: TOPS,
    mm.observables.energy: {"scene": TOP, "states": STATES},
    mm.observables.kinetic_energy: {"scene": TOP, "states": STATES},
    mm.observables.magnetic_energy: {"scene": TOP, "states": STATES},
    mm.observables.magnetic_energy_and_lift: {"scene": TOP, "states": STATES},
    mm.observables.momentum_map: {**TURNING, "axis": VECTOR},
    mm.observables.slip_velocity: {**TURNING, "velocity": VECTOR},
    mm.observables.friction_torque: {"scene": TOP, "axis": VECTOR, "slip": VECTOR},
    mm.observables.flight_survival: lambda: {"run": run_of("ensemble")},
    mm.kinetic_temperature: STILL,
    mm.configurational_temperature: {**STILL, "forces": lambda data: -data.qpos},
    mm.metropolis: {
        "model": PENDULUM, "kT": 1.0, "samples": 2, "replicas": 2, "seed": 1, "record_interval": 1,
        "burn_in": 1, "potential": lambda data: 0.0, "initial": [0.0],
    },
    mm.observables.local_slope: lambda: {"run": run_of("ensemble"), "factor": 2.0},
    mm.dipoles.field: {"points": VECTOR, "positions": POINTS, "moments": POINTS},
    mm.dipoles.wrench: DIPOLES,
    mm.dipoles.energy: DIPOLES,
    mm.dipoles.force_and_field: DIPOLES,
    mm.noise.BrownianPath: {
        "seed": 1, "timestep": 0.1, "factor": 1, "level": 0, "hold": 2, "window": 3,
    },
    mm.noise.BrownianPath(1, 0.1).coarsened: {"factor": 2},
    mm.noise.BrownianPath(1, 0.1).refined: {"halvings": 1},
    mm.noise.BrownianPath(1, 0.1).held: {"steps": 2, "window": 3},
    mm.noise.BrownianPath(1, 0.1).increments: {"steps": 2, "first": 0, "replica": 0, "channel": 0},
    mm.theory.gibbs: {"scene": DISK, "replicas": 3, "seed": 1, "d": 1.0},
    mm.ensemble: {
        "scene": DISK, **STEPS, "duration": 4.0, "replicas": 4, "seed": 1, "sample_interval": 10,
        "burn_in": 0.0, "initial": {"x": 1.0}, "trajectories": 1, "threads": 1, "checkpoint": None,
    },
    mm.simulate: {
        "scene": DISK, **STEPS, "engine": "any", "duration": 1.0, "seed": 1, "replicas": 2,
        "record_interval": 5,
        "initial": {"x": 1.0}, "path": mm.noise.BrownianPath(1, 0.02), "checkpoint": None,
        "allow_unstable": False,
    },
    mm.recommend: {
        "scene": DISK, "error": 0.01, "quantity": "temperature", "engine": "any", "measure": False,
        **STEPS,
    },
    mm.methods: {"scene": DISK},
    mm.build: {"scene": DISK, "visual": False},
    mm.scene_of: lambda: {"run": run_of("disk")},
    mm.rerun: lambda: {"run": run_of("disk")},
    mm.read_scene: {"path": "scene.toml"},
    mm.write_scene: {"scene": TOP, "path": "scene.toml"},
    mm.to_table: lambda: {"data": run_of("disk"), "rows": ["time"]},
    mm.Langevin: {
        "model": PENDULUM, "kT": 1.0, "splitting": "baoab", "friction": 1.0, "disable": ["limit"],
        "seed": 1, "path": mm.noise.BrownianPath(1, 0.002),
    },
    mm.Langevin(PENDULUM, 1.0).step: {"data": mujoco.MjData(PENDULUM), "nstep": 1},
    mm.Langevin(PENDULUM, 1.0).sample: {
        "duration": 0.008, "replicas": 2, "record_interval": 2, "burn_in": 0.002,
        "initial": mujoco.MjData(PENDULUM),
    },
    mm.Langevin(PENDULUM, 1.0).forces: {"data": mujoco.MjData(PENDULUM)},
    mm.Langevin(PENDULUM, 1.0).largest_timestep: {"data": mujoco.MjData(PENDULUM)},
    mm.brownian_rows: {"model": PENDULUM, "kT": 1.0},
    mm.JointNoise: {"model": PENDULUM, "kT": 1.0, "seed": 1, "replica": 0},
    mm.JointNoise(PENDULUM, 1.0).force: {"data": mujoco.MjData(PENDULUM)},
    mm.ViscousContact: {
        "damping": 0.3, "sphere": "ball", "plane": "floor", "bears_load": True, "name": "slip",
    },
    CONTACT.add_to: {"description": mujoco.MjSpec()},
    CONTACT.calibrate: {"model": mm.build(TOP)},
    CONTACT.damping_of: {"model": mm.build(TOP)},
    mm.field: {"model": MODEL, "data": mujoco.MjData(MODEL), "points": POINTS},
    mm.tabulated_field: {
        "field": np.zeros_like,
        "lower": (0, 0, 0),
        "upper": (1, 1, 1),
        "shape": (4, 4, 4),
    },
    mm.save_responses: {"model": MODEL, "path": "responses"},
    mm.magnetic_energy: {"model": MODEL, "data": mujoco.MjData(MODEL)},
    mm.add_dipole: {
        "spec": SPEC, "body": SPEC.worldbody, "moment": 1.0, "pos": VECTOR, "zaxis": VECTOR,
        "name": "",
    },
    mm.add_magnet: {
        "spec": SPEC, "body": SPEC.worldbody, "magnet": mm.magnet("sphere", 0.01, remanence=1.2),
        "error": 0.1, "gap": 0.02, "name": "", "units": (1, 1, 1),
    },
    mm.add_coil: {
        "spec": SPEC, "actuator": SPEC.actuators[0], "dipoles": [SPEC.site("tip")],
        "saturation": 1.0, "name": "coil",
    },
    mm.add_field: {
        "spec": SPEC, "field": VECTOR, "frame": SPEC.site("tip"), "actuator": SPEC.actuators[0],
        "saturation": 1.0, "name": "field",
    },
    mm.add_iron: {
        "spec": SPEC, "geoms": [SPEC.geom("ball")], "susceptibility": 1.0, "saturation": 1.0,
        "spacing": 0.001, "name": "iron",
    },
    mm.add_hysteresis: {
        "spec": SPEC, "sites": [SPEC.site("tip")], "coercivity": 12.0, "remanence": 0.2,
        "name": "hysteresis",
    },
    mm.add_conductor: {
        "spec": SPEC, "geoms": [SPEC.geom("ball")], "conductivity": 3.5e7, "thickness": 0.003,
        "name": "conductor",
    },
    mm.add_magnetism: {"spec": SPEC},
    mm.describe: {"model": MODEL},
    mm.check: {"model": MODEL},
    mm.advise: {
        "model": PENDULUM, "data": TOSSED, "quantity": "energy", "duration": 0.2, "error": 0.1,
        "every_element": True, "budget": 1.0, "detail": True, "kT": 1.0, "picture": "advice.png",
    },
    mm.magnet: {"shape": "sphere", "size": 0.01, "remanence": 1.2, "direction": (0, 0, 1)},
    mm.Magnet: {"shape": "cylinder", "size": (0.01, 0.02), "remanence": 1.2, "density": 7e3},
    mm.magnet("cylinder", (0.01, 0.02), grade="N42").dipoles: {"error": 0.1, "gap": 0.02},
    mm.magnet("cylinder", (0.01, 0.02), grade="N42").mjcf: {"error": 0.1, "gap": 0.02, "name": ""},
    mm.draw_moments: {"view": mujoco.MjvScene(), "model": MODEL, "data": mujoco.MjData(MODEL)},
    mm.draw_field: {
        "view": mujoco.MjvScene(), "model": MODEL, "data": mujoco.MjData(MODEL), "points": POINTS,
    },
    mm.apply_perturbation: {
        "model": MODEL, "data": mujoco.MjData(MODEL), "perturb": mujoco.MjvPerturb()
    },
    mm.plots.overview: lambda: {**TOPS(), "path": "top.png"},
    mm.plots.MotorRun: lambda: {"name": "run", "data": run_of("motor")},
    mm.plots.motor_overview: lambda: {
        "run": mm.plots.MotorRun("run", run_of("motor")), "path": "motor.png", "others": []
    },
    mm.plots.sweep: {"data": None, "path": "sweep.png"},
    mm.render.movie: lambda: {**TOPS(), "path": "top.mp4", "speed": 1.0},
    mm.render.still: lambda: {**TOPS(), "path": "top.png", "time": 0.1},
    mm.render.contact_sheet: lambda: {
        "runs": [run_of("top")], "scenes": [TOP], "labels": ["a"], "path": "sheet.mp4",
        "columns": 1, "speed": 1.0,
    },
    live.live_scene: {"scene": DISK, "method": "mujoco/euler", "timestep": 0.02, "seed": 1},
    live.LiveSimulation: {"model": MODEL, "panel": None, "seed": 0},
    LIVE.switch: {"name": "noise"},
    LIVE.advance: {"steps": 1, "perturb": None},
    LIVE.hold: {"perturb": mujoco.MjvPerturb()},
    live.Pace: {"speed": 1.0, "now": 0.0},
    live.Pace(1.0, 0.0).steps: {"now": 1.0, "timestep": 0.1},
    mm.Top.paper: {"case": 4},
    mm.Motor.paper: {"run": "uniform-a"},
    TOP.ring_pose: {"time": 0.0},
    TOP.ring_sources: {"time": 0.0},
    MOTOR.ring_sources: {"time": 0.0},
    TOP.ring_orientation: {"time": 0.0},
    TOP.in_air: {"speed": 0.1, "viscosity": 1.8e-5, "density": 1.2},
    MOTOR.in_air: {"speed": 0.01, "viscosity": 1.8e-5, "density": 1.2},
    mm.theory.eddy_drag: {"scene": TOP, "conductivity": 3.5e7},
    mm.theory.motor_tolerances: {"scene": MOTOR},
    mm.theory.plate_shaking: {"scene": MOTOR},
    mm.theory.damper_shaking: {"scene": MOTOR},
    mm.theory.axis_magnet: {
        "scene": MOTOR, "moment": 1.0, "coil_radius": 0.02, "turns": 100, "hold": 0.1,
    },
    TOP.in_world: {"positions": POINTS, "moments": POINTS, "time": 0.0},
    **{
        kind: {field: getattr(kind(), field) for field in inspect.signature(kind).parameters}
        for kind in (mm.Top, mm.Motor, mm.Disk, mm.LangevinParticle)
    },
}  # fmt: skip
"""Valid arguments, or a function that returns them.

None stands for results of sweeps, which other tests create.
"""

RECORDS = {
    mm.Waypoint, mm.Recommendation, mm.Advice, mm.observables.CriticalPoint,
    mm.observables.MotorWells, mm.theory.SmallMotion, mm.magnetism, mm.Description, mm.Check,
}  # fmt: skip
"""Callables that store their arguments unchecked, or take none; so do exceptions."""

SERVED = {live.web, live.WebView, live.Loop}
"""What a page and a window are made of; tests/programs/test_web_view.py calls them."""

VALUES = "LARGEST_SEED", "STYLE"
"""Public names that are not callable."""

DRAWN = {
    getattr(module, name)
    for module in (mm.plots, mm.render)
    for name in module.__all__
    if name not in VALUES
}
"""Functions that need seconds or OpenGL."""

RIGHT_ALL_THE_SAME = {
    (mm.scene_of, "run", "a run of another scene"),
    (mm.rerun, "run", "a run of another scene"),
    (mm.to_table, "data", "a run of another scene"),
    (mm.Langevin, "disable", "an empty dataset"),
}
"""Valid after all; an empty dataset is also an empty mapping, and has no elements."""


def test_the_table_is_complete():
    modules = (mm.dipoles, mm.noise, mm.observables, mm.plots, mm.render, mm.theory, live, mm)
    found = set()
    for module in modules:
        names = getattr(module, "__all__", None) or ["field", "wrench", "energy", "force_and_field"]
        found |= {getattr(module, name) for name in names if name not in VALUES}
    found = {each for each in found if callable(each)}
    exceptions = {each for each in found if isclass(each) and issubclass(each, BaseException)}
    assert not found - {*CALLS} - RECORDS - SERVED - exceptions


def test_help_shows_bounds_instead_of_objects():
    """In the signatures of all that is public."""
    for function in CALLS:
        said = str(inspect.signature(function))
        assert not re.search(r"functools\.partial|<function|object at 0x", said), function
    assert "[float, number, above 0]" in str(inspect.signature(mm.ensemble))
    assert "[int, integer, at least 0]" in str(inspect.signature(mm.ensemble))


def name_of(function):
    return f"{function.__module__.removeprefix('magmotor.')}.{function.__qualname__}"


@pytest.mark.filterwarnings("ignore:.*are these millimeters")
@pytest.mark.filterwarnings("ignore:.*of the energy with which its motion starts")
@pytest.mark.parametrize("function", CALLS, ids=name_of)
def test_what_an_argument_is_not(function, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    given = CALLS[function]
    right = given() if callable(given) else given
    takes_disk = right.get("scene") is DISK or right.get("run") is run_of("ensemble")
    silent, raw = [], []
    for name in right:
        others = {
            "a scene of another class": other_scene(function),
            "a run of another scene": run_of("top" if takes_disk else "disk"),
        }
        for what, value in {**WRONG, **others, **PERHAPS}.items():
            if (function, name, what) in RIGHT_ALL_THE_SAME or (
                what in PERHAPS and is_right(function, value)
            ):
                continue
            try:
                function(**right | {name: value})
            except (ValueError, OSError, mm.SimulationStopped, mujoco.FatalError) as error:
                if not str(error).strip():
                    raw.append((name, what, repr(error)))
            except Exception as error:
                raw.append((name, what, repr(error)[:200]))
            else:
                if what not in PERHAPS:
                    silent.append((name, what))
    assert not raw
    assert not silent


def other_scene(function):
    """A scene of a class that the function does not accept; an object if it accepts all."""
    hint = str(inspect.signature(function).parameters.get("scene", ""))
    if "BallScene" in hint:
        return DISK
    if ".Scene" in hint:
        return object()
    return next((s for s in (TOP, MOTOR, DISK) if f".{type(s).__name__}" not in hint), object())


def is_right(function, value):
    """Whether the function might draw something, which is slow."""
    return function in DRAWN and (value is None or isinstance(value, float | str))


@pytest.mark.parametrize("path", ["folder", "missing/top", "top.xyz"])
def test_a_picture_is_written_where_it_can_be(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folders = {tmp_path / f"folder{suffix}" for suffix in (".png", ".mp4")}
    for folder in folders:
        folder.mkdir()
    picture, film = (path if "." in path else path + suffix for suffix in (".png", ".mp4"))
    with refused("path"):
        mm.plots.overview(run_of("top"), None, picture)
    with refused("path"):
        mm.render.movie(run_of("top"), TOP, film)
    assert {*tmp_path.iterdir()} == folders


def test_a_picture_takes_the_runs_own_scene(tmp_path):
    mm.plots.overview(run_of("top"), None, tmp_path / "top.png")
    assert (tmp_path / "top.png").stat().st_size > 10_000
    with refused("scene.friction"):
        mm.plots.overview(run_of("top"), TOP.replace(friction=0.5), tmp_path / "other.png")


def test_nothing_has_no_rows():
    assert mm.brownian_rows(mujoco.MjModel.from_xml_string("<mujoco/>"), 1.0).shape == (1, 0)


def test_a_wall_is_an_infinite_energy():
    wall = {"potential": lambda data: math.inf if data.qpos[0] < 0 else 0.0, "initial": [0.1]}
    assert (
        mm.metropolis(PENDULUM, 1.0, samples=100, replicas=2, burn_in=10, **wall).qpos >= 0
    ).all()


@pytest.mark.parametrize("field", ["friction", "noise", "sigma", "friction_ratio"])
@pytest.mark.parametrize("value", [1e-30, 1e30])
def test_at_the_ends_of_the_range_results_are_finite_or_refused(field, value):
    scene = mm.Disk(**{field: value})
    for name in SCENE_FUNCTIONS[DISK].split()[:-2]:
        try:
            found = getattr(mm.theory, name)(scene)
        except ValueError:
            continue
        values = [*found.values()] if isinstance(found, dict) else found
        assert np.isfinite(values).all() or name in ("friction_step_limit", "largest_timestep")


def test_a_checked_function_keeps_its_name_signature_and_docstring():
    function = mm.theory.libration_frequency
    assert function.__name__ == "libration_frequency"
    assert [*inspect.signature(function).parameters] == ["scene", "field"]
    assert "Angular frequency" in (inspect.getdoc(function) or "")
    with pytest.raises(TypeError):
        function(TOP)  # pyright: ignore[reportCallIssue]


def test_the_ends_of_ranges_belong_to_them():
    assert check_number("field", 1e30) == 1e30
    assert check_number("field", -1e-30) == -1e-30
    assert check_integer("field", 2**53) == 2**53
    assert check_array("field", [-1e30, 1e-300]).tolist() == [-1e30, 1e-300]
    with refused("field"):
        check_integer("field", 2**53 + 1)


@pytest.mark.parametrize("warned", ["error", "always"])
@pytest.mark.parametrize("value", [0.0, 1e-320])
def test_what_numpy_warns_of_is_an_error_whether_warnings_are_or_not(warned, value):
    """Even if the result is finite: 1/inf is 0."""

    def harmonic(x):
        return float(1 / (1 / np.float64(x)))

    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter(warned)
        with pytest.raises(mm.InputError):
            checked(harmonic)(value)
        assert checked(finite=False)(harmonic)(value) == 0
    assert not seen
