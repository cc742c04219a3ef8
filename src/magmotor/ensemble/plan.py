"""When an ensemble samples, records, and begins its statistics: all in samples."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.checks import check_integer, check_number, reject
from magmotor.noise import LARGEST_STEP

RECORDS_PER_DECADE = 24


class Plan(NamedTuple):
    """Steps between samples, and numbers of samples: in all, recorded, and before statistics."""

    interval: int
    samples: int
    records: NDArray[np.int64]
    burn_in: int
    levels: int


def plan(timestep: float, duration: float, sample_interval: int, burn_in: float) -> Plan:
    """Records at logarithmic and, so that curves can be drawn over linear time, even spacing.

    Raises
    ------
    ValueError
        Names the argument, its value and the bound.
    """
    timestep = check_number("timestep", timestep, above=0)
    sample_interval = check_integer("sample_interval", sample_interval, at_least=1)
    least, most = 4 * sample_interval * timestep, LARGEST_STEP * timestep
    duration = check_number("duration", duration, at_least=least, below=most)
    burn_in = check_number("burn_in", burn_in, at_least=0)
    samples = int(duration / (sample_interval * timestep) * (1 + 1e-12))
    if burn_in / (sample_interval * timestep) >= samples - 3.5:
        raise reject("burn_in", burn_in, f"at most {(samples - 4) * sample_interval * timestep:g}")
    first = round(burn_in / (sample_interval * timestep))
    decades = np.log10(samples)
    logarithmic = np.logspace(0, decades, 1 + int(np.ceil(RECORDS_PER_DECADE * decades)))
    even = np.linspace(0, samples, 101)
    records = np.unique(np.concatenate([logarithmic, even]).round().astype(np.int64))
    # The longest lag has some four pairs of successive increments in each replica.
    levels = int(np.log2((samples - first) / 4)) + 1
    return Plan(sample_interval, samples, records, first, levels)
