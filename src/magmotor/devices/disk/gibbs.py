"""Initial states drawn from the Gibbs measure."""

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.common.hints import Count, Seed, number
from magmotor.devices.disk.scene import Disk, LangevinParticle, derivative, steepest_curvature
from magmotor.devices.disk.theory.stationary import gibbs_deviations
from magmotor.numerics.reproducible import applied

RARE = 1e-3
"""Part of the tries that the simplest bound on U lets through, below which a closer one is used."""

COLDEST = 1e6
"""Largest beta max|U''|: of so deep a well one try in some thousand hits the bottom."""


@checked
def gibbs(
    scene: Disk | LangevinParticle,
    replicas: Count,
    *,
    seed: Seed = 0,
    d: Annotated[float, number()] | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Independent states of the Gibbs measure exp(-beta E), equation (kjhss).

    Parameters
    ----------
    scene : Disk or LangevinParticle
    replicas : int
        How many.
    seed : int
        Of NumPy's generator; it has nothing to do with the Brownian paths of the same seed.
    d : float, optional
        Of a disk, the measure given that sigma omega - v has this value, dimensionless. The
        position and the slip v + omega, which are independent of it, are distributed as without.

    Returns
    -------
    dict
        `x` in [0, 2 pi), `v` and, of the disk, `theta` in [0, 2 pi) and `omega`, shape (replicas,):
        what `simulate` and `ensemble` take as `initial`.

    Raises
    ------
    ValueError
        The scene has no temperature or one that is next to none, `replicas` is less than 1, or
        `d` is given for a Langevin particle.
    """
    if not scene.noise:
        raise reject("noise", scene.noise, "must be positive: without it there is no temperature")
    if d is not None and not isinstance(scene, Disk):
        raise reject("d", d, "must be None: a Langevin particle has no disk that rotates")
    random = np.random.default_rng(seed)
    x = _positions(scene, replicas, random)
    v, *omega = gibbs_deviations(scene)
    state = {"x": x, "v": v * random.standard_normal(replicas)}
    if isinstance(scene, Disk):
        state["theta"] = random.uniform(0, 2 * math.pi, replicas)
        state["omega"] = omega[0] * random.standard_normal(replicas)
        if d is not None:
            change = (d - scene.sigma * state["omega"] + state["v"]) / (1 + scene.sigma)
            state["v"] -= change
            state["omega"] += change
    return state


def _positions(scene: Disk | LangevinParticle, replicas: int, random: np.random.Generator):
    """Rejection from the uniform law, which is exact for every potential."""
    lowest, tries = -sum(abs(a) + abs(b) for a, b in scene.coefficients), replicas
    grid = np.linspace(0, 2 * math.pi, 4096, endpoint=False)
    energy = derivative(scene.coefficients, grid)
    if np.mean(np.exp(-scene.beta * (energy - lowest))) < RARE:
        # Half a step from the grid U is not lower than this.
        within = (math.pi / 4096) ** 2 * steepest_curvature(scene.coefficients)
        lowest, tries = float(energy.min()) - within, max(replicas, 10**5)
        if scene.beta * (steepest_curvature(scene.coefficients) + within) > COLDEST:
            sentence = f"must be so large that beta max|U''| is at most {COLDEST:g}"
            raise reject("noise", scene.noise, sentence)
    kept = np.empty(0)
    while len(kept) < replicas:
        x = random.uniform(0, 2 * math.pi, tries)
        weight = applied(math.exp, -scene.beta * (derivative(scene.coefficients, x) - lowest))
        kept = np.append(kept, x[random.uniform(size=tries) < weight])
    return kept[:replicas]
