"""What the front door asks of an engine."""

from typing import Any, NamedTuple

from magmotor.noise import BrownianPath


class Job(NamedTuple):
    """A run: `records` states after the initial one, each `record_interval` steps apart.

    An engine's function `run(job)` yields them in chunks. The first step is number `first_step` of
    the Brownian path, whose timestep is the run's.
    """

    scene: Any
    scheme: str
    timestep: float
    records: int
    record_interval: int
    initial: Any
    path: BrownianPath
    first_step: int
