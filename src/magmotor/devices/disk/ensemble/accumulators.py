"""On-line statistics of sampled states: increment correlations, histograms, flights.

Every array has an axis of replicas, or of groups of replicas that are summed in order at the end,
so that results depend neither on the number of threads nor on the division of the run.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.device.checkpoint import LARGEST
from magmotor.devices.disk.observables import energy
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.states import DiskStates
from magmotor.devices.disk.variational import LANES, TURN
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import njit, subroutine
from magmotor.numerics.simd import broadcast, fused, lane_numbers, load, store, total, where_less

BINS = 120
REACH = 6.0
"""Histograms of velocities have `BINS` bins over `REACH` standard deviations to either side."""

HYSTERESIS = 0.1
"""A flight ends when d is beyond zero by this fraction of its standard deviation."""

BINS_PER_OCTAVE = 4
FLIGHT_BINS = 4 * 40

_SUMS = 6


class Statistics(NamedTuple):
    """Accumulators of G groups of replicas, R replicas with padding, and L levels of lags.

    The lag of level j is 2^j samples. `sums` holds the number of pairs of successive increments
    a, b and their sums of a, b, a^2, b^2 and ab; `counts` the histograms of x mod 2 pi, v and
    omega; `direction` the last sign of d beyond the hysteresis; `departure` the sample at which the
    flight began, or 0; `flights` the number of finished flights by logarithmic bins of duration.
    """

    last: NDArray[np.float64]  # (L, R)
    increment: NDArray[np.float64]  # (L, R)
    sums: NDArray[np.float64]  # (G, L, 6)
    counts: NDArray[np.int64]  # (G, 3, BINS)
    direction: NDArray[np.int64]  # (R,)
    departure: NDArray[np.int64]  # (R,)
    flights: NDArray[np.int64]  # (G, FLIGHT_BINS)


def empty(replicas: int, levels: int, lanes: int) -> Statistics:
    """Return accumulators without samples, for groups of `lanes`; `replicas` includes padding."""
    groups = -(-replicas // lanes)
    return Statistics(
        last=np.zeros((levels, replicas)),
        increment=np.zeros((levels, replicas)),
        sums=np.zeros((groups, levels, _SUMS)),
        counts=np.zeros((groups, 3, BINS), np.int64),
        direction=np.zeros(replicas, np.int64),
        departure=np.zeros(replicas, np.int64),
        flights=np.zeros((groups, FLIGHT_BINS), np.int64),
    )


def bounds(samples: int) -> dict[str, tuple[Any, Any]]:
    """Return the least and largest values of accumulators after a number of samples."""
    most = LANES * (samples + 1)
    return {
        "sums": (np.array([0, -LARGEST, -LARGEST, 0, 0, -LARGEST]), LARGEST),
        "counts": (0, most),
        "direction": (-1, 1),
        "departure": (0, samples),
        "flights": (0, most),
    }


def flight_bin_edges() -> NDArray[np.float64]:
    """Return the edges of the bins of flights: durations in samples."""
    return 2.0 ** (np.arange(FLIGHT_BINS + 1) / BINS_PER_OCTAVE)


@njit
def flight_bin(samples):
    """Return the bin of a duration in samples, which is at least 1."""
    return min(FLIGHT_BINS - 1, int(math.log2(samples) * BINS_PER_OCTAVE))


@subroutine(forceinline=True)
def _correlate(states, last, increment, level, sums, start, lanes, number):
    zero, period, end = broadcast(0.0), broadcast(TURN), broadcast(float(lanes))
    a_sum = b_sum = aa = bb = ab = zero
    for i in range(0, lanes, COUNT):
        here, lane = start + i, lane_numbers() + broadcast(float(i))
        x = period * load(states, 0, i)
        a, b = load(increment, level, here), x - load(last, level, here)
        store(increment, level, here, b)
        store(last, level, here, x)
        # Padding does not count.
        a, b = where_less(lane, end, a, zero), where_less(lane, end, b, zero)
        a_sum, b_sum = a_sum + a, b_sum + b
        aa, bb, ab = fused(a, a, aa), fused(b, b, bb), fused(a, b, ab)
    if number >= 2:
        sums[0] += lanes
        sums[1] += total(a_sum)
        sums[2] += total(b_sum)
        sums[3] += total(aa)
        sums[4] += total(bb)
        sums[5] += total(ab)


@compiled_once(nogil=True, error_model="numpy")
def _compiled_accumulate(checksum: int):
    """Return the function `accumulate`."""

    def accumulate(statistics, block, group, start, lanes, first_sample, deviations, sigma):
        """Add samples of one group of replicas to the statistics.

        Parameters
        ----------
        statistics : Statistics
        block : ndarray, shape (samples, 4, >= lanes)
            Rows x in turns, theta, v, omega, as from the kernel.
        group, start, lanes : int
            Number of the group, its first replica, and its number of replicas without padding.
        first_sample : int
            Number of the block's first sample since the statistics began.
        deviations : tuple of float
            Standard deviations of v, omega and d.
        sigma : float
        """
        _ = checksum
        last, increment, sums, counts, direction, departure, flights = statistics
        levels = last.shape[0]
        per_v = BINS / (2 * REACH * deviations[0])
        per_omega = BINS / (2 * REACH * deviations[1])
        threshold = HYSTERESIS * deviations[2]
        for row in range(block.shape[0]):
            sample = first_sample + row
            for level in range(levels):
                if sample & ((1 << level) - 1):
                    break
                _correlate(
                    block[row], last, increment, level, sums[group, level], start, lanes,
                    sample >> level,
                )  # fmt: skip
            for i in range(lanes):
                x, v, omega = block[row, 0, i], block[row, 2, i], block[row, 3, i]
                counts[group, 0, max(0, min(BINS - 1, int((x - math.floor(x)) * BINS)))] += 1
                counts[group, 1, max(0, min(BINS - 1, int(v * per_v + BINS / 2)))] += 1
                counts[group, 2, max(0, min(BINS - 1, int(omega * per_omega + BINS / 2)))] += 1
                d = sigma * omega - v
                now = int(d > threshold) - int(d < -threshold)
                before = direction[start + i]
                if now and now != before:
                    if before and departure[start + i]:
                        flights[group, flight_bin(sample - departure[start + i])] += 1
                    direction[start + i] = now
                    # The beginning of the first flight is unknown.
                    departure[start + i] = sample if before else 0

    return accumulate


accumulate = _compiled_accumulate()


def unfinished_flights(statistics: Statistics, replicas: int, sample: int) -> NDArray[np.int64]:
    """Return the number of unfinished flights at a sample, by the bins of their durations."""
    began = statistics.departure[:replicas]
    lasting = sample - began[began > 0]
    counts = np.zeros(FLIGHT_BINS, np.int64)
    for duration in lasting[lasting > 0]:
        counts[flight_bin(duration)] += 1
    return counts


POWERS = (1, 2, 4)
"""Orders of the moments; the fourth gives the standard error of the second."""


def quantities(scene: Disk | LangevinParticle) -> dict[str, str]:
    """Return names and descriptions of the quantities whose moments are computed."""
    common = {
        "x": "displacement since the start",
        "v": "velocity",
        "energy": "total energy",
    }
    if not scene.has_rotation:
        return common
    return common | {
        "omega": "angular velocity",
        "slip": "slip velocity v + omega",
        "d": "-v + sigma omega, which friction and noise leave alone",
        "y": "displacement of x + theta since the start",
    }


def moments(
    scene: Disk | LangevinParticle, states: DiskStates, start: DiskStates
) -> NDArray[np.float64]:
    """Return the moments of all `quantities` in the last row, shape (quantities, powers)."""
    x, v, omega = states.x[-1], states.v[-1], None
    displacement = x - start.x[-1]
    columns = [displacement, v]
    if scene.has_rotation:
        assert states.theta is not None
        assert states.omega is not None
        assert start.theta is not None
        omega = states.omega[-1]
        rotation = states.theta[-1] - start.theta[-1]
        d = scene.masses[-1] * omega - v
        columns += [omega, v + omega, d, displacement + rotation]
    columns.insert(2, energy(scene, x, v, omega))
    squares = [column * column for column in columns]
    fourth = [square * square for square in squares]
    return np.array([np.mean(powers, axis=1) for powers in (columns, squares, fourth)]).T
