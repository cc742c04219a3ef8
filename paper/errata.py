"""The paper's wrong formulas for the sliding disk, as printed, and the lines that they imply.

They are compared with the correct formulas of `magmotor.theory` and with measurements; nothing else
uses them. `docs/errata.md` explains each error and names the test that shows it.

Everything is dimensionless. The coefficients share one error. C = n n^T, n = (1, 1/sigma),
has rank one: C^(1/2) (dB_v, dB_omega) = n dW with *one* Brownian motion W. The paper diagonalizes
C^(1/2) with the matrix V that diagonalizes C diag(1, sigma), which is right only at sigma = 1.
"""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from magmotor import theory
from magmotor.devices.disk.scene import Disk
from paper.disk.panels import GUIDE, Guide
from paper.disk.system import System

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def y_diffusion(scene: Disk) -> float:
    """Return the limit 2 alpha^2 sigma^2/(c^2 (sigma^2 + 1)) of var(x + theta)/t, (kskjhs3).

    Wrong unless sigma = 1. The slip's noise is not sqrt(2) alpha (sigma + 1)/sqrt(sigma^2 + 1) dB_s
    but alpha gamma dW, so that the limit is alpha^2/c^2, `theory.y_diffusion`.
    """
    sigma = scene.sigma
    return 2 * (scene.noise * sigma / scene.friction) ** 2 / (sigma**2 + 1)


def flat_x_diffusion(scene: Disk) -> float:
    """Return the limit `y_diffusion`/(1 + sigma)^2 of var(x)/t on flat U, second (kskjhs3).

    Wrong unless sigma = 1. `y_diffusion` is wrong, and the factor sigma^2 of
    x = (sigma y - z)/(1 + sigma) is missing; `theory.flat_x_diffusion` is right.
    """
    return y_diffusion(scene) / (1 + scene.sigma) ** 2


def velocity_noise_coefficient(scene: Disk) -> float:
    """Return the noise coefficient sqrt(2) alpha/sqrt(sigma^2 + 1) of v_t, equation (eq:v).

    Wrong unless sigma = 1. The slip's noise is wrong, and the factor sigma of
    v = (sigma s - d)/(1 + sigma) is missing; the coefficient is alpha,
    `theory.velocity_noise_coefficient`.
    """
    return math.sqrt(2) * scene.noise / math.hypot(scene.sigma, 1)


def upper_ballistic_bound(scene: Disk) -> float:
    """Return the bound 4/(beta (1 + sigma)) on lim sup var(x)/t^2, second equation (ksddssdkjhs3).

    True but vacuous. The mean of v is zero and mu is ergodic, so the limit is zero.
    """
    return 4 * theory.ballistic_coefficient(scene)


def lower_ballistic_bound(scene: Disk) -> float:
    """Return the bound 1/(4 beta (1 + sigma)) on lim inf var(x)/t^2, third equation (ksddssdkjhs3).

    False: the limit is zero. Time reversal gives E[A_t^2] = E[B_t^2] in the proof only before the
    mean E[. | xi_0] is subtracted; afterwards A_t -> 0 and B_t -> d_t.
    """
    return theory.ballistic_coefficient(scene) / 4


GROWTH = "the paper: ∝ t²; flat: {flat:.4g} t"

LINES = {
    "mean_square": GROWTH,
    "msd": GROWTH,
    "slope": "the paper: 2; flat and control: 1",
    "diffusion": "the paper: ∝ t; flat: {flat:.4g}",
}
"""Legend texts for the paper's predictions in figures of the disk."""


def paper_lines(systems: Iterable[System], name: str) -> Guide | None:
    """Return the lines that the paper predicts in a figure of the disk.

    Parameters
    ----------
    systems : iterable of System
        The systems in the figure.
    name : str
        Name of the figure; `overview` has several panels.

    Returns
    -------
    Guide or None
        None if the paper predicts nothing that can be drawn.
    """
    label = GROWTH if name == "overview" else LINES.get(name)
    if label is None:
        return None
    flat = next((paper_flat(system) for system in systems if system.name == "flat"), 0.0)
    return Guide(label.format(flat=flat), _draw)


def paper_flat(system: System) -> float:
    """Return `flat_x_diffusion` of a system that is a disk on flat U."""
    scene = system.theory.scene
    assert isinstance(scene, Disk)
    return flat_x_diffusion(scene)


def _draw(axes: "Axes", name: str, system: System) -> None:
    """Draw ballistic growth for the disks on a potential, and diffusion for the flat one."""
    if name == "slope":
        axes.axhline(2 if system.has_varying_d else 1, **GUIDE)
    elif name in LINES and system.has_varying_d:
        t = _times(name, system)
        square = float(system.theory.mean_square(system.end)) * (t / system.end) ** 2
        axes.plot(t, square / t if name == "diffusion" else square, **GUIDE)
    elif name == "diffusion" and system.name == "flat":
        axes.axhline(paper_flat(system), **GUIDE)
    elif name in LINES and system.name == "flat":
        t = _times(name, system)
        axes.plot(t, paper_flat(system) * t, **GUIDE)


def _times(name: str, system: System) -> NDArray[np.float64]:
    """Return evenly spaced times of the run, or its later part for logarithmic axes."""
    if name == "mean_square":
        return np.linspace(0, system.end, 61)[1:]
    return system.later[system.later > system.end / 30]
