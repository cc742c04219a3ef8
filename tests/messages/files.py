"""Files: checkpoints, scene files, movies and pictures."""

import dataclasses
import errno
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import numpy as np
from runs import own_device

import magmotor as mm
from magmotor.commands.picture_options import PictureOptions
from magmotor.common import files as whole_files
from magmotor.device import Gauge
from magmotor.device import checkpoint as checkpoints
from magmotor.device.device import SCENES, Scene
from trials import checkpoint_files

DISK: dict[str, Any] = {
    "method": "variational/baoab",
    "timestep": 0.05,
    "duration": 10.0,
    "record_interval": 7,
}


def run(path, scene=None, **changes):
    """Simulate three disks with a checkpoint."""
    arguments: dict[str, Any] = {**DISK, "seed": 3, "replicas": 3, **changes}
    return mm.simulate(scene or mm.Disk(), checkpoint=path, **arguments)


def disks(path):
    """Simulate an ensemble of ten disks with a checkpoint."""
    numbers: dict[str, Any] = {
        "timestep": 0.05,
        "duration": 10.0,
        "replicas": 10,
        "trajectories": 2,
    }
    return mm.ensemble(mm.Disk(), method="variational/baoab", checkpoint=path, **numbers)


def load(path, change=None, spoil=None, **told):
    """Load a checkpoint with other arrays, another first line or other bytes."""
    like = {"x": np.arange(6.0).reshape(2, 3), "n": np.array([1, 2])}
    wanted = {"x": checkpoints.Expected(like["x"]), "n": checkpoints.Expected(like["n"], 0, 9)}
    mine = checkpoints.Checkpoint(path, {"seed": 1}, 5, lambda done: wanted)
    mine.save(4, like if change is None else change(like))
    checkpoint_files.write(path, *checkpoint_files.read(path), **told)
    if spoil is not None:
        path.write_bytes(spoil(path.read_bytes()))
    return mine.load()


def full(_):
    """Write to a full disk."""
    raise OSError(errno.ENOSPC, "No space left on device")


def scene(text):
    """Read a scene from a file with this text."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "my.toml")
        path.write_bytes(text.encode(errors="surrogateescape"))
        return mm.read_scene(path)


def top(**fields):
    """Simulate a top for 40 steps."""
    return mm.simulate(mm.Top(**fields), method="mujoco/rk4", timestep=0.025, duration=1)


def sheet(runs, scenes, labels=("a", "b", "c"), columns=3, **options):
    """Make a contact sheet of three tops."""
    return mm.render.contact_sheet(runs, scenes, labels, "sheet.mp4", columns=columns, **options)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Made(Scene):
    """A scene with a field of any type."""

    by: object = None


TABLE = r"""
# Paths of checkpoints
>>> run("missing/run.checkpoint")
ArgumentError: checkpoint = 'missing/run.checkpoint': must be in an existing folder, and missing
    is not one
>>> disks("missing/run.checkpoint")
ArgumentError: checkpoint = 'missing/run.checkpoint': must be in an existing folder, and missing
    is not one
>>> run(7)
ArgumentError: checkpoint = 7: must be a path: a string or a pathlib.Path
>>> run(b"run")
ArgumentError: checkpoint = b'run': must be a path: a string or a pathlib.Path
>>> run("a\0b")
ArgumentError: checkpoint = 'a\x00b': must be a path: a string or a pathlib.Path
>>> run(["run"])
ArgumentError: checkpoint = ['run']: must be a path: a string or a pathlib.Path
>>> here = TemporaryDirectory()
>>> run(here.name)
ArgumentError: checkpoint = '...': must be a regular file, or not exist yet
>>> file = Path(here.name, "file")
>>> file.touch()
>>> run(file / "run.checkpoint")
ArgumentError: checkpoint = '.../file/run.checkpoint': must be in an existing folder, and .../file
    is not one
>>> pipe = Path(here.name, "pipe")
>>> os.mkfifo(pipe)
>>> run(pipe)
ArgumentError: checkpoint = '.../pipe': must be a regular file, or not exist yet
>>> here.cleanup()

# Checkpoints of another task
>>> here = TemporaryDirectory()
>>> path = Path(here.name, "run.checkpoint")
>>> made = run(path)
>>> made = run(path, seed=4)
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: seed was 3
    there and is 4 here
>>> made = run(path, timestep=0.04)
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: timestep was
    0.05 there and is 0.04 here
>>> made = run(path, duration=20.0)
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: duration was
    10.0 there and is 20.0 here
>>> made = run(path, initial={"x": 1.0})
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: it started
    from another initial state
>>> made = run(path, replicas=4)
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: replicas was 3
    there and is 4 here
>>> made = run(path, mm.Disk(x=0.5))
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: scene.x was
    0.0 there and is 0.5 here
>>> load(path, task={"seed": 1, "more": 2})
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: more was given
    there only
>>> load(path, task={"seed": 1, "more": None})
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: more was given
    there only
>>> load(path, task={})
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: seed is given
    here only
>>> load(path, task={"seed": 2})
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: seed was 2
    there and is 1 here
>>> load(path, task={"speed": 1})
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is of another run: seed is given
    here only
>>> here.cleanup()

# Damaged checkpoints
>>> here = TemporaryDirectory()
>>> path = Path(here.name, "run.checkpoint")
>>> load(path, spoil=lambda content: b"not mine")
ArgumentError: checkpoint = '.../run.checkpoint': the file is not a checkpoint
>>> load(path, spoil=lambda content: b"")
ArgumentError: checkpoint = '.../run.checkpoint': the file is not a checkpoint
>>> load(path, spoil=lambda content: content[:200])
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is damaged: it is too short or
    too long
>>> load(path, spoil=lambda content: content + b"\0")
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is damaged: it is too short or
    too long
>>> load(path, spoil=lambda content: content[:-65] + b"\1" + content[-64:])
ArgumentError: checkpoint = '.../run.checkpoint': the checkpoint is damaged: its checksum does not
    match
>>> load(path, lambda arrays: {name: array[..., :-1] for name, array in arrays.items()})
ArgumentError: checkpoint = '.../run.checkpoint': must have the arrays [['x', '<f8', 2, 3], ['n',
    '<i8', 2]], and has [['x', '<f8', 2, 2], ['n', '<i8', 1]]
>>> load(path, lambda arrays: arrays | {"more": np.zeros(1)})
ArgumentError: checkpoint = '.../run.checkpoint': must have the arrays [['x', '<f8', 2, 3], ['n',
    '<i8', 2]], and has [['x', '<f8', 2, 3], ['n', '<i8', 2], ['more', '<f8', 1]]
>>> load(path, lambda arrays: arrays | {"x": np.full((2, 3), np.nan)})
ArgumentError: checkpoint = '.../run.checkpoint': its x must be finite and in bounds, and has the
    value nan
>>> load(path, lambda arrays: arrays | {"n": np.array([1, 10])})
ArgumentError: checkpoint = '.../run.checkpoint': its n must be finite and in bounds, and has the
    value 10
>>> load(path, arrays=None)
ArgumentError: checkpoint = '.../run.checkpoint': must have the arrays [['x', '<f8', 2, 3], ['n',
    '<i8', 2]], and has None
>>> load(path, done=6)
ArgumentError: checkpoint = '.../run.checkpoint': the number of finished records must be 0 to 5,
    and is 6
>>> load(path, done="3")
ArgumentError: checkpoint = '.../run.checkpoint': the number of finished records must be 0 to 5,
    and is '3'
>>> here.cleanup()

# Checkpoints that cannot be saved
>>> here = TemporaryDirectory()
>>> path = Path(here.name, "run.checkpoint")
>>> with patch.object(whole_files.os, "fsync", full):
...     made = run(path)
UserWarning: cannot save .../run.checkpoint: No space left on device; the previous checkpoint is
    kept
>>> with patch.object(whole_files.os, "fsync", full):
...     made = disks(path)
UserWarning: cannot save .../run.checkpoint: No space left on device; the previous checkpoint is
    kept
>>> here.cleanup()

# Scenes in files
>>> with patch.dict(SCENES, {"Made": Made}):
...     mm.write_scene(Made(by=np.zeros(2)), "made.toml")
ArgumentError: by = array([0., 0.]): cannot be stored: must be a number, text, or a tuple of those
>>> mm.write_scene(mm.Top(), "top.json")
ArgumentError: path = 'top.json': must end in .toml
>>> scene("")
InputError: .../my.toml: it must have a key scene, the name of a class: Disk, ...
>>> scene("scene = 3")
InputError: .../my.toml: scene = 3: must be one of Disk, ...; import the module that defines the
    scene class first
>>> scene('scene = "Tops"')
InputError: .../my.toml: scene = 'Tops': must be one of Disk, ... (did you mean 'Top'?); import
    the module that defines the scene class first
>>> scene('scene = "Top"\nfrictoin = 1.0')
InputError: .../my.toml: field = 'frictoin': must be one of ball_mass, ball_radius, coupling,
    gravity, surface, floor_tilt, background_field, drag, rotational_drag, ball_inertia,
    ball_axial_inertia, center_of_mass, products_of_inertia, friction, torsional_damping,
    position, velocity, axis, spin, ring_dipoles, ring_radius, ring_height, tilt, tilt_azimuth,
    ring_script, coulomb_friction, torsional_friction, rolling_friction (did you mean 'friction'?)
>>> scene('scene = "Top"\ndevice = 1')
InputError: .../my.toml: field = 'device': must be one of ball_mass, ball_radius, coupling,
    gravity, surface, floor_tilt, background_field, drag, rotational_drag, ball_inertia,
    ball_axial_inertia, center_of_mass, products_of_inertia, friction, torsional_damping,
    position, velocity, axis, spin, ring_dipoles, ring_radius, ring_height, tilt, tilt_azimuth,
    ring_script, coulomb_friction, torsional_friction, rolling_friction
>>> scene('scene = "Top"\nfriction = "big"')
InputError: .../my.toml: friction = 'big': must be a number
>>> scene('scene = "Top"\nfriction = true')
InputError: .../my.toml: friction = True: must be a number, not True or False
>>> scene('scene = "Top"\nfriction = nan')
InputError: .../my.toml: friction = nan: must be a finite number
>>> scene('scene = "Top"\nfriction = -1')
InputError: .../my.toml: friction = -1: must be at least 0 kg/s
>>> scene('scene = "Top"\nfriction = 2026-01-01')
InputError: .../my.toml: friction = datetime.date(2026, 1, 1): must be a number
>>> scene('scene = "Top"\n[friction]\na = 1')
InputError: .../my.toml: friction = {'a': 1}: must be a number
>>> scene('scene = "Top"\nring_dipoles = 20.0')
InputError: .../my.toml: ring_dipoles = 20.0: must be an integer
>>> scene('scene = "Top"\nposition = [0.1]')
InputError: .../my.toml: position = (0.1,): must be 2 numbers
>>> scene('scene = "Top"\nring_script = [1]')
InputError: .../my.toml: ring_script[0] = 1: must be time, height, tilt and optionally an azimuth
>>> scene('scene = "Disk"\npotential = [["sin"]]')
InputError: .../my.toml: potential[0] = ('sin',): must be a pair (a_1, b_1) of numbers

# Files that are not scenes
>>> scene('scene = "Top"\nfriction = ')
InputError: .../my.toml: it is not TOML: Invalid value (at end of document)
>>> scene("a = " + 40_000 * "[")
InputError: .../my.toml: it is not TOML: ...
>>> scene("a = " + 10_000 * "1")
InputError: .../my.toml: it is not TOML: ...
>>> scene("\udcff")
InputError: .../my.toml: it is not TOML: it is not text in UTF-8
>>> scene(50_001 * "#")
InputError: .../my.toml: it is too long for a scene
>>> scene(f"[{'.'.join(24_000 * 'a')}]")
InputError: .../my.toml: it has a key of more than five parts, but fields have one
>>> scene(f"{' . '.join(12_000 * ['a'])} = 1")
InputError: .../my.toml: it has a key of more than five parts, but fields have one
>>> scene(f"a = {{b = 1, {'.'.join(12_000 * 'a')} = 1}}")
InputError: .../my.toml: it has a key of more than five parts, but fields have one

# Movies and pictures
>>> run = top()
>>> movie = mm.render.movie
>>> movie(mm.Top(), run, "top.mp4")
ArgumentError: run = Top(...): must be the dataset, and `scene` its scene: exchange these two
    arguments
>>> movie(run, mm.Top(), "top.avi")
ArgumentError: path = 'top.avi': must be a file name that ends in one of .mp4, .webm, .gif
>>> movie(run, mm.Top(), "top")
ArgumentError: path = 'top': must be a file name that ends in one of .mp4, .webm, .gif
>>> movie(run, mm.Top(), "missing/top.mp4")
ArgumentError: path = 'missing/top.mp4': must be in an existing folder
>>> movie(run, mm.Top(), "top.mp4", size=(641, 360))
ArgumentError: size = (641, 360): must be (width, height), even numbers from 320 x 180 to 3840 x
    2160
>>> movie(run, mm.Top(), "top.mp4", size=(200, 100))
ArgumentError: size = (200, 100): must be (width, height), even numbers from 320 x 180 to 3840 x
    2160
>>> movie(run, mm.Top(), "top.mp4", size=720)
ArgumentError: size = 720: must be (width, height), even numbers from 320 x 180 to 3840 x 2160
>>> movie(run, mm.Top(), "top.mp4", fps=0)
ArgumentError: fps = 0: must be at least 1
>>> movie(run, mm.Top(), "top.mp4", speed=0)
ArgumentError: speed = 0: must be greater than 0
>>> movie(run, mm.Top(), "top.mp4", speed=1e-6)
ArgumentError: speed = 1e-06: must be large enough for a movie of at most 200000 frames
>>> movie(run, mm.Top(), "top.gif", speed=1e-3)
ArgumentError: path = 'top.gif': a GIF of 640 x 360 pixels can have 1165 frames, and this one has
    15031: choose a higher speed, a lower fps, a smaller size, or .mp4
>>> mm.render.still(run.expand_dims(replica=2), mm.Top(), "top.png", 1.0)
ArgumentError: replicas = 2: select one: run.isel(replica=0)
>>> mm.render.still(run, mm.Disk(), "disk.png", 1.0)
ArgumentError: scene = Disk(friction=0.1, noise=5.0, potential='symmetric', x=0.0, v=0.0,
    sigma=0.5, friction_ratio=0.0, drag=0.0, rotational_drag=0.0, drag_temperature=None,
    theta=0.0, omega=0.0, surface='planar'): must be the scene of the run, a Top, or None for that
    scene
>>> exact = mm.simulate(mm.Top(), method="scipy/dop853", timestep=0.1, duration=1)
>>> movie(exact, mm.Top(), "top.mp4")
ArgumentError: run = ['position', 'velocity', 'axis', 'angular_velocity', 'slip_velocity',
    'momentum_map', 'energy']: the dataset must also have orientation, as runs by mujoco/* and
    variational/* do
>>> PictureOptions(dpi=0).check_pictures()
ArgumentError: dpi = 0: must be at least 10

# Pictures of a device outside of the package
>>> own = own_device()
>>> numbers = {"method": "variational/baoab", "timestep": 0.01, "duration": 0.1}
>>> run = mm.simulate(own.Rotor(), **numbers)
>>> with patch.object(own.RotorMovieContent, "near", "front"):
...     mm.render.movie(run, None, "rotor.mp4")
ArgumentError: RotorMovieContent.near = 'front': must be another camera than that of the main view
>>> with patch.object(own.RotorMovieContent, "near", "side"):
...     mm.render.still(run, None, "rotor.png", 0.05)
ArgumentError: camera = 'side': the model of a Rotor must have this camera
>>> def drawn(run):
...     mm.render.contact_sheet([run], [own.Rotor()], ["a"], "sheet.mp4", columns=1)
>>> drawn(run)
ArgumentError: scene = Rotor(inertia=2e-06, moment=0.5, magnet=20.0, distance=0.2, damping=1e-05,
    kT=2e-05, angle=1.0, rate=0.0): there are no contact sheets of a Rotor
>>> angle = Gauge("angle", "rad", ("theta",), lambda run, _: run.theta.values, (), lambda _: 0.1)
>>> own.RotorDevice.gauge = angle
>>> drawn(run)
ArgumentError: runs[0] = ['theta', 'omega', 'energy']: the dataset must also have position
>>> run["position"] = ("time", "space"), np.zeros((run.sizes["time"], 3))
>>> run = run.assign_coords(space=[*"xyz"])
>>> drawn(run)
ArgumentError: scene = Rotor(inertia=2e-06, moment=0.5, magnet=20.0, distance=0.2, damping=1e-05,
    kT=2e-05, angle=1.0, rate=0.0): must have ball_radius to be shown in a contact sheet
>>> own.Rotor.ball_radius = 0.01
>>> drawn(run)
ArgumentError: geom = 'ball': the model of a Rotor must have this geom
>>> plain = own.RotorDevice.compose
>>> def with_ball(self, scene, *, visual):
...     spec = plain(self, scene, visual=visual)
...     ball = spec.body("needle").add_geom(name="ball", size=[0.01, 0, 0])
...     return spec
>>> own.RotorDevice.compose = with_ball
>>> own.Rotor.ball_radius = 0.02
>>> run = mm.simulate(own.Rotor(angle=0.5), **numbers)
>>> run["position"] = ("time", "space"), np.zeros((run.sizes["time"], 3))
>>> run = run.assign_coords(space=[*"xyz"])
>>> mm.render.contact_sheet([run], [own.Rotor(angle=0.5)], ["a"], "sheet.mp4", columns=1)
ArgumentError: camera = 'top': the model of a Rotor must have this camera

# Contact sheets
>>> scenes = [mm.Top(tilt=tilt) for tilt in (0.0, 0.05, 0.2)]
>>> runs = [top(tilt=tilt) for tilt in (0.0, 0.05, 0.2)]
>>> sheet([], scenes)
ArgumentError: len(runs) = 0: must be 1 to 15: 5 rows of 3
>>> sheet([*runs, *runs], scenes, columns=1)
ArgumentError: len(runs) = 6: must be 1 to 5: 5 rows of 1
>>> sheet(runs, scenes[:2])
ArgumentError: len(scenes) = 2: must be 3, the number of runs
>>> sheet(runs, scenes, labels=["a", "b"])
ArgumentError: len(labels) = 2: must be 3, the number of runs
>>> sheet(runs, scenes, columns=0)
ArgumentError: columns = 0: must be at least 1
>>> sheet(runs, scenes, columns=9)
ArgumentError: columns = 9: must be at most 8
>>> sheet(runs, scenes, columns=1.5)
ArgumentError: columns = 1.5: must be an integer
>>> sheet(runs, [mm.Disk()] * 3)
ArgumentError: scene = Disk(friction=0.1, noise=5.0, potential='symmetric', x=0.0, v=0.0,
    sigma=0.5, friction_ratio=0.0, drag=0.0, rotational_drag=0.0, drag_temperature=None,
    theta=0.0, omega=0.0, surface='planar'): must be the scene of the run, a Top, or None for that
    scene
>>> sheet(runs, [*scenes[:2], mm.Motor()])
ArgumentError: scene = Motor(...): must be the scene of the run, a Top, or None for that scene
>>> sheet([*runs[:2], runs[2].expand_dims(replica=2)], scenes)
ArgumentError: replicas = 2: select one: runs[2].isel(replica=0)
>>> sheet([*runs[:2], runs[2].drop_vars("orientation")], scenes)
ArgumentError: run = ['position', 'velocity', 'axis', 'angular_velocity', 'slip_velocity',
    'momentum_map', 'energy']: the dataset must also have orientation, as runs by mujoco/* and
    variational/* do
>>> sheet(runs, scenes, speed=0)
ArgumentError: speed = 0: must be greater than 0
"""
