"""Curves of the paper's four systems: exact if U is flat, else from the reduced equation."""

import math
from functools import cached_property

import numpy as np
from scipy.linalg import eigh_tridiagonal

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.environment import physical_memory
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Times
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.theory.flat import (
    flat_mean_displacement,
    flat_msd_from_gibbs,
    flat_variance_from_rest,
)
from magmotor.devices.disk.theory.fokker_planck import ReducedDisk
from magmotor.devices.disk.theory.stationary import friction_rates, slip_rate


class DiskTheory:
    """Curves of a system, from rest at x = 0 or stationary; times and lags are positive.

    The curves of the disk follow from `ReducedDisk`, or are exact on flat U; those of the Langevin
    particle are for a free one. Both require temperatures far above U. At the paper's parameters,
    the measured mean square from rest, for symmetric U, is 2 to 3 % (+- 0.4 %) below theory at
    t = 50..200, and within 1 % (+- 0.5 %) from t = 700.

    Parameters
    ----------
    scene : Disk or LangevinParticle
    """

    @checked
    def __init__(self, scene: Disk | LangevinParticle) -> None:
        self.scene = scene

    @property
    def has_varying_d(self) -> bool:
        """Whether d varies: a disk in a potential that is not flat."""
        return self.scene.has_rotation and bool(self.scene.coefficients)

    @cached_property
    def reduced(self) -> ReducedDisk:
        """The reduced equation of the disk's d."""
        if not isinstance(self.scene, Disk):
            raise ArgumentError("scene", self.scene, "must be a Disk, since only a disk has d")
        return ReducedDisk(self.scene)

    @checked
    def mean_square(self, t: Times) -> Array:
        """Return the mean square displacement from rest."""
        if self.has_varying_d:
            return self.reduced.msd_from_rest(t)
        return flat_variance_from_rest(self.scene, t)

    @checked
    def variance(self, t: Times) -> Array:
        """Return the variance of x from rest."""
        return self.mean_square(t) - self.mean(t) ** 2

    @checked
    def mean(self, t: Times) -> Array:
        """Return the mean of x from rest at x = 0, after the noise has carried x over U.

        Until then, the force -U'(0) acts on all replicas alike. At first order in U, the slip
        forgets its impulse at the rate lambda, and d at the rates of the reduced equation.
        """
        t = np.asarray(t, dtype=float)
        if not self.has_varying_d:
            return self.first_impulse * flat_mean_displacement(self.scene.replace(v=1.0), t)
        sigma, rate = self.reduced.scene.sigma, slip_rate(self.reduced.scene)
        moved = (self._memory(t) - sigma * np.expm1(-rate * t) / rate) / (1 + sigma)
        return self.first_impulse * moved

    @cached_property
    @checked
    def first_impulse(self) -> float:
        """Mean impulse -int E[U'(x_t)] dt of U on x from rest at x = 0, at first order."""
        from scipy.integrate import quad

        def duration(k: int) -> float:
            """Return the integral of E[cos k x_t]."""
            unit = self._decay_time(k)
            return unit * quad(lambda t: self._phase(k, unit * t), 0, math.inf)[0]

        pairs = enumerate(self.scene.coefficients, start=1)
        return -sum(k * a * duration(k) for k, (a, _) in pairs if a)

    @checked
    def correlation(self, lag: Times) -> Array:
        """Return the correlation of two successive increments of x in the stationary state.

        It is MSD(2 lag)/(2 MSD(lag)) - 1; on flat U, at d = 0 where d is conserved.
        """
        lag = np.asarray(lag, dtype=float)
        if self.has_varying_d:
            return self.reduced.increment_correlation(lag)
        direction = None
        if self.scene.has_rotation and not friction_rates(self.scene)[0]:
            # x = sigma y/(1 + sigma) at d = 0, and y = x + theta is independent of d.
            sigma = self.scene.masses[-1]
            direction = np.full(2, sigma / (1 + sigma))
        once, twice = (
            flat_msd_from_gibbs(self.scene, n * lag, direction=direction) for n in (1, 2)
        )
        return twice / (2 * once) - 1

    def _decay_time(self, k: int) -> float:
        """Return a power of two near the time at which the variance of k x_t reaches one."""
        for exponent in range(-99, 100):
            if k**2 * flat_variance_from_rest(self.scene, 2.0**exponent) > 1:
                return 2.0**exponent
        raise ArgumentError(
            "noise", self.scene.noise, "must be larger, so that x forgets the phase of U"
        )

    def _phase(self, k: int, t: float) -> float:
        """Return E[cos k x_t] from rest on flat U."""
        return math.exp(-(k**2) * float(flat_variance_from_rest(self.scene, t)) / 2)

    def _memory(self, t: Array) -> Array:
        """Return the integral of E[d_s]/d_0 over s < t, from a small d_0."""
        rates, weights = self._relaxation
        return -np.expm1(-np.multiply.outer(t, rates)) @ (weights / rates)

    @cached_property
    def _relaxation(self) -> tuple[Array, Array]:
        """Rates and weights of E[d_t]/d_0: the reduced equation's modes that are odd in d."""
        cells = len(self.reduced.d)
        if 16 * cells**2 > physical_memory():
            raise ArgumentError(
                "scene",
                self.scene,
                f"D(d) needs {cells} cells, too many for this computer's memory",
            )
        up, down, d = self.reduced.up[1:], self.reduced.down[1:], self.reduced.d[1:]
        rates, modes = eigh_tridiagonal(up + down, -np.sqrt(up[:-1] * down[1:]))
        root = np.sqrt(self.reduced.probability[1:])
        return rates, modes[0] / (root[0] * d[0]) * ((root * d) @ modes)
