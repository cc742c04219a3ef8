"""Initial states drawn from the Gibbs measure."""

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Count, Seed, number
from magmotor.devices.disk.scene import Disk, LangevinParticle, derivative, steepest_curvature
from magmotor.devices.disk.theory.stationary import gibbs_deviations
from magmotor.numerics.reproducible import applied

RARE = 1e-3
"""Acceptance rate of the simplest bound on U below which a closer bound is used."""

COLDEST = 1e6
"""Largest beta max|U''|; in such a deep well, one of about a thousand samples is accepted."""


@checked
def gibbs(
    scene: Disk | LangevinParticle,
    replicas: Count,
    *,
    seed: Seed = 0,
    d: Annotated[float, number()] | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Draw independent states from the Gibbs measure exp(-beta E), equation (kjhss).

    Parameters
    ----------
    scene : Disk or LangevinParticle
    replicas : int
        Number of states.
    seed : int
        Seed of NumPy's generator; Brownian paths with the same seed are independent of it.
    d : float, optional
        For a disk, condition the measure on this value of sigma omega - v, dimensionless. The
        distributions of the position and of the slip v + omega do not depend on it.

    Returns
    -------
    dict
        `x` in [0, 2 pi), `v` and, for the disk, `theta` in [0, 2 pi) and `omega`, each of shape
        (replicas,); `simulate` and `ensemble` accept it as `initial`.

    Raises
    ------
    ValueError
        The temperature is zero or extremely low, the background drag has another temperature,
        `replicas` is less than 1, or `d` is given for a Langevin particle.
    """
    if not scene.noise:
        raise ArgumentError(
            "noise", scene.noise, "must be positive, since the temperature is zero without it"
        )
    if d is not None and not scene.has_rotation:
        raise ArgumentError("d", d, "must be None, since a Langevin particle does not rotate")
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
    """Sample x by rejection from the uniform distribution, exactly for every potential."""
    lowest, tries = -sum(abs(a) + abs(b) for a, b in scene.coefficients), replicas
    grid = np.linspace(0, 2 * math.pi, 4096, endpoint=False)
    energy = derivative(scene.coefficients, grid)
    if np.mean(np.exp(-scene.beta * (energy - lowest))) < RARE:
        # Within half a step of a grid point, U is at most this much lower.
        margin = (math.pi / 4096) ** 2 * steepest_curvature(scene.coefficients)
        lowest, tries = float(energy.min()) - margin, max(replicas, 10**5)
        if scene.beta * (steepest_curvature(scene.coefficients) + margin) > COLDEST:
            sentence = f"must be so large that beta max|U''| is at most {COLDEST:g}"
            raise ArgumentError("noise", scene.noise, sentence)
    kept = np.empty(0)
    while len(kept) < replicas:
        x = random.uniform(0, 2 * math.pi, tries)
        weight = applied(math.exp, -scene.beta * (derivative(scene.coefficients, x) - lowest))
        kept = np.append(kept, x[random.uniform(size=tries) < weight])
    return kept[:replicas]
