"""Checksums of all results and pictures, to verify that a change leaves them the same.

`python tests/checksums.py FILE` writes them as JSON; with `--against BEFORE` it names those that
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
    "export_mjcf.py top top.xml",
    "export_mjcf.py motor motor.xml",
    "export_mjcf.py disk disk.xml",
    "sweep.py top --vary tilt=0:0.2:4 --duration 2",
    "sweep.py disk --vary noise=1:5:3 --replicas 8 --duration 20",
    "figures.py --quick --out figures",
)


def digest(*arrays: np.ndarray | bytes) -> str:
    """SHA-256 of arrays, cut to 16 hexadecimal digits."""
    sums = hashlib.sha256()
    for array in arrays:
        sums.update(array if isinstance(array, bytes) else np.ascontiguousarray(array).tobytes())
    return sums.hexdigest()[:16]


def of_dataset(run: xr.Dataset) -> str:
    """Checksum of the names and values of the variables, regardless of their order."""
    named = [(str(name), run[name].values) for name in sorted(run.variables, key=str)]
    numbers = [(name, array) for name, array in named if array.dtype.kind in "fiub"]
    return digest(*[part for name, array in numbers for part in (name.encode(), array)])


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
        yield f"gibbs: {name}", digest(*mm.gibbs(SCENES[name], 100).values())


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
    """Every array of every model, with and without visual elements."""
    for name, scene in SCENES.items():
        if isinstance(scene, mm.LangevinParticle):
            continue
        model = mm.build(scene)
        fields = [getattr(model, field) for field in sorted(dir(model)) if field[0] != "_"]
        yield f"model: {name}", digest(*[f for f in fields if isinstance(f, np.ndarray)])


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
    for part in (models, sweeps, ensembles, runs, programs):
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
