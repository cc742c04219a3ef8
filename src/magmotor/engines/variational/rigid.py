"""Runs of rigid bodies by their compiled kernel: replicas on all threads, recorded as they go."""

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from magmotor.engines.job import Job
from magmotor.engines.variational.rigid_forces import Magnets
from magmotor.engines.variational.rigid_kernel import kernel
from magmotor.engines.variational.rigid_law import Bodies, law
from magmotor.engines.variational.schemes import RIGID
from magmotor.threads import thread_count

Array = NDArray[np.float64]


def march(
    job: Job, bodies: Bodies, magnets: Magnets, start: Array, threads: int | None = None
) -> Generator[tuple[Array, Array, Array]]:
    """Yield times, records of shape (T, R, SIZE) and the states that came last, in chunks.

    `start` are the states of the R replicas, as the kernel takes them; `threads` are
    `thread_count()` if not given.
    """
    advance = kernel(job.scheme)
    numbers = bodies, magnets, law(bodies, RIGID[job.scheme], job.timestep)
    path = job.path.seed, job.path.factor, job.path.level
    states = (start if job.state is None else job.state).copy()
    threads = min(len(states), threads or thread_count())
    ends = [len(states) * k // threads for k in range(threads + 1)]
    with ThreadPoolExecutor(threads) as pool:
        for step, times in job.chunks(len(states)):
            recorded = np.empty((len(times), *states.shape))
            for steps in job.pieces(step, len(times), len(states)):
                parts = [(states, recorded, rows, steps, path, *numbers) for rows in pairwise(ends)]
                if threads == 1:
                    advance(*parts[0])  # a thread takes longer to start than many a run
                else:
                    for part in [pool.submit(advance, *part) for part in parts]:
                        part.result()
            yield times, recorded, states.copy()


def on_plane(flat: Array, height: float) -> Array:
    """Vectors from their x and y and one z for all; shapes (..., 2) -> (..., 3)."""
    return np.concatenate([flat, np.full((*flat.shape[:-1], 1), height)], axis=-1)
