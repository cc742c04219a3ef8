"""The best rate of a few batch sizes."""

import time
from collections.abc import Callable


def rate(run: Callable[[int], object], batches: tuple[int, ...], steps: int) -> dict[str, float]:
    """Trajectory-steps/s and batch size; run(batch) takes a batch of replicas through steps."""
    best = {"rate": 0.0, "batch": 0}
    for batch in batches:
        run(batch)  # compiles
        for _ in range(3):
            begin = time.perf_counter()
            run(batch)
            reached = batch * steps / (time.perf_counter() - begin)
            if reached > best["rate"]:
                best = {"rate": reached, "batch": batch}
    return best
