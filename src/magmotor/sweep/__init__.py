"""Parameter sweeps: their definition, the workers that run them, and their results on disk."""

from magmotor.sweep.axes import Range, Samples, Values
from magmotor.sweep.combine import combine
from magmotor.sweep.compute import OtherVersions
from magmotor.sweep.dask_cluster import dask_workers, local_cluster
from magmotor.sweep.definition import Sweep, sweep_from
from magmotor.sweep.directory import Status, status, sweep_of
from magmotor.sweep.driver import NoWorkers, SweepFailed, SweepInterrupted, Tally, run
from magmotor.sweep.estimate import Estimate, estimate
from magmotor.sweep.measures import measures

__all__ = [
    "Estimate",
    "NoWorkers",
    "OtherVersions",
    "Range",
    "Samples",
    "Status",
    "Sweep",
    "SweepFailed",
    "SweepInterrupted",
    "Tally",
    "Values",
    "combine",
    "dask_workers",
    "estimate",
    "local_cluster",
    "measures",
    "run",
    "status",
    "sweep_from",
    "sweep_of",
]
