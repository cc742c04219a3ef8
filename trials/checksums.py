"""Checksums of all results and pictures, to verify that a change leaves them the same.

`python -m trials.checksums FILE` writes them as JSON; with `--against BEFORE` it names those that
differ from another file's, and fails if there are any. It takes some minutes: every method of every
scene, ensembles, sweeps, the scenes' MJCF, the programs' files, the paper's figures.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import xarray as xr

import magmotor as mm
from magmotor.sweep import Sweep

ROOT = Path(__file__).parents[1]

SCENES: dict[str, Any] = {
    "top": mm.Top(),
    "top, spinning": mm.Top(axis=(0.1, 0.2, 0.9), spin=1.0, tilt_azimuth=0.3),
    "top, anisotropic": mm.Top(ball_axial_inertia=4e-5),
    "top, ring moved": mm.Top(
        ring_script=(mm.Waypoint(0.0, 0.3, 0.0), mm.Waypoint(0.3, 0.25, 0.1))
    ),
    "top on the plane": mm.Top(surface="plane"),
    "top on the plane, dry friction": mm.Top(surface="plane", coulomb_friction=0.1),
    "motor": mm.Motor(),
    "motor without noise": mm.Motor(alpha_ball=0.0, alpha_ring=0.0),
    "motor of nonuniform temperature": mm.Motor(temperature="nonuniform"),
    "motor on the plane": mm.Motor(surface="plane"),
    "disk": mm.Disk(),
    "disk, skew": mm.Disk(potential=((1.0, 0.2), (0.4, 0.0)), friction_ratio=0.5),
    "disk, flat": mm.Disk(potential="flat"),
    "disk without noise": mm.Disk(noise=0.0, v=1.0),
    "disk on the plane": mm.Disk(surface="plane"),
    "particle": mm.LangevinParticle(),
}

PROGRAMS = (
    "disk.py --duration 200 --replicas 64",
    "motor.py --duration 200",
    "movie.py top --duration 0.4",
    "export.py top top.xml",
    "export.py motor motor.xml",
    "export.py disk disk.xml",
    "sweep.py top --vary tilt=0:0.2:4 --duration 2",
    "sweep.py disk --vary noise=1:5:3 --replicas 8 --duration 20",
    "figures.py --quick --out figures",
)


def digest(*arrays: np.ndarray | bytes) -> str:
    """SHA-256 of arrays with their types and shapes, cut to 16 hexadecimal digits."""
    sums = hashlib.sha256()
    for array in arrays:
        if not isinstance(array, bytes):
            sums.update(f"{array.dtype.str} {array.shape}".encode())
            array = np.ascontiguousarray(array).tobytes()
        sums.update(array)
    return sums.hexdigest()[:16]


def of_dataset(run: xr.Dataset) -> str:
    """Checksum of names, dimensions and values of the variables, regardless of their order.

    Units, labels and other attributes do not count.
    """
    parts = []
    for name in sorted(run.variables, key=str):
        values = run[name].values
        if values.dtype.kind not in "fiub":
            values = repr(values.tolist()).encode()
        parts += [f"{name} {run[name].dims}".encode(), values]
    return digest(*parts)


def runs() -> Iterator[tuple[str, str]]:
    """Every method of every scene, started and continued; divergence counts as a result."""
    for name, scene in SCENES.items():
        small = isinstance(scene, mm.Top | mm.Motor)
        noisy = any(getattr(scene, "noises", ())) or getattr(scene, "noise", 0) > 0
        replicas = 3 if noisy else None
        for method in mm.methods(scene):
            timestep = 0.002 if small else 0.04
            numerics = {"method": method, "timestep": timestep, "duration": 200 * timestep}
            try:
                run = mm.simulate(
                    scene, record_interval=20, replicas=replicas, allow_unstable=True, **numerics
                )
                more = mm.simulate(scene, initial=run, replicas=replicas, **numerics)
            except mm.SimulationStopped as diverged:
                run = more = diverged.dataset
            yield f"simulate: {name}, {method}", of_dataset(run)
            yield f"simulate: {name}, {method}, going on", of_dataset(more)


def ensembles() -> Iterator[tuple[str, str]]:
    for name in ("disk", "disk, skew", "disk, flat", "particle"):
        for method in [m for m in mm.methods(SCENES[name]) if m.startswith("variational")]:
            result = mm.ensemble(
                SCENES[name], method=method, timestep=0.04, duration=20.0, replicas=37, burn_in=4.0
            )
            yield f"ensemble: {name}, {method}", of_dataset(result)
        yield f"gibbs: {name}", digest(*mm.theory.gibbs(SCENES[name], 100).values())
    numerics: dict[str, Any] = {"timestep": 0.04, "duration": 4.0, "replicas": 5, "seed": 3}
    for method in ("variational/baoab", "mujoco/baoab"):
        result = mm.ensemble(SCENES["motor"], method=method, **numerics)
        yield f"ensemble: motor, {method}", of_dataset(result)
        yield f"ensemble: motor, {method}, rerun", of_dataset(mm.rerun(result))


def others() -> Iterator[tuple[str, str]]:
    """Runs that an event or a divergence ends, views of a path, checkpoints, a user's model."""
    scene, timestep = SCENES["motor"], 0.04
    path = mm.noise.BrownianPath(5, timestep)
    for name, view in (("own", path), ("coarse", path.coarsened(3)), ("fine", path.refined(2))):
        run = mm.simulate(scene, method="variational/baoab", path=view, duration=12 * timestep)
        yield f"path: {name}", of_dataset(run)
    ended = {
        "ring tipped": (scene, {"initial": {"ring_angular_velocity": (2.0, 0.0, 0.0)}}),
        "diverged": (mm.Top(ring_height=0.05, coupling=1e-3), {"allow_unstable": True}),
    }
    for name, (other, options) in ended.items():
        try:
            mm.simulate(
                other, method="variational/baoab", timestep=timestep, duration=40.0, **options
            )
            raise AssertionError(f"{name}: the run did not end early")
        except mm.SimulationStopped as stop:
            yield f"ended: {name}", of_dataset(stop.dataset)
    with tempfile.TemporaryDirectory() as folder:
        numerics: dict[str, Any] = {"method": "variational/baoab", "timestep": timestep}
        for duration in (4.0, 8.0):
            numerics["initial"] = None if duration == 4.0 else run
            run = mm.simulate(
                scene, duration=duration, checkpoint=Path(folder) / f"{duration}", **numerics
            )
        yield "checkpoint", of_dataset(run)
    model = mm.build(scene)
    model.opt.timestep = timestep
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mm.Langevin(model).step(data, nstep=100)
    yield "Langevin", digest(data.qpos, data.qvel, data.xfrc_applied)


def sweeps() -> Iterator[tuple[str, str]]:
    for name, field in (("top", "tilt"), ("motor", "inner_height"), ("disk", "noise")):
        arguments: dict[str, Any] = {
            "scene": SCENES[name],
            "vary": {field: [0.1, 0.2, 0.3] if name != "motor" else [0.47, 0.48, 0.49]},
            "method": "variational/" + ("verlet" if name == "top" else "baoab"),
            "timestep": 0.002 if name != "disk" else 0.04,
            "duration": 2.0,
        }
        planned = Sweep(**arguments, measure=["trajectory"], versions={})
        yield f"sweep: {name}, keys", digest("".join(case.key for case in planned).encode())
        for measure in ([*mm.sweep.measures(SCENES[name])], ["trajectory"]):
            with tempfile.TemporaryDirectory() as folder:
                mm.sweep.run(Sweep(**arguments, measure=measure), folder, workers=1)
                yield f"sweep: {name}, {measure[0]}", of_dataset(mm.sweep.combine(folder))


def models() -> Iterator[tuple[str, str]]:
    """Every model as a binary file, with and without visual elements."""
    for name, scene in SCENES.items():
        if isinstance(scene, mm.LangevinParticle):
            continue
        for visual in (False, True):
            model = mm.build(scene, visual=visual)
            content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
            mujoco.mj_saveModel(model, None, content)
            yield f"model: {name}, visual {visual}", digest(content)


def programs() -> Iterator[tuple[str, str]]:
    """Checksums of all files that each program writes."""
    for line in PROGRAMS:
        with tempfile.TemporaryDirectory() as folder:
            script, *arguments = line.split()
            command = [sys.executable, str(ROOT / "scripts" / script), *arguments]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
            for path in sorted(Path(folder).rglob("*.*")):
                name = f"{line}: {path.relative_to(folder)}"
                if path.suffix == ".nc":
                    with xr.open_dataset(path) as run:
                        yield name, of_dataset(run)
                elif path.suffix in {".png", ".xml"} or path.parent.name == "figures":
                    yield name, digest(path.read_bytes())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--against", type=Path)
    options = parser.parse_args()
    found = {}
    for part in (models, others, sweeps, ensembles, runs, programs):
        found |= dict(part())
        print(f"{part.__name__}: {len(found)} checksums so far", flush=True)
    options.file.write_text(json.dumps(found, indent=1) + "\n")
    print(f"all: {digest(json.dumps(found, sort_keys=True).encode())}")
    if options.against is None:
        return 0
    before = json.loads(options.against.read_text())
    differ = [name for name in before.keys() | found.keys() if before.get(name) != found.get(name)]
    print(f"{len(found)} checksums, {len(differ)} differ", *sorted(differ), sep="\n  ")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
