"""Parameter sweeps: what varies, who computes it, where results are, and how to read them."""

from magmotor.sweep.axes import Range, Samples, Values
from magmotor.sweep.combine import combine
from magmotor.sweep.dask_cluster import dask_workers, local_cluster
from magmotor.sweep.definition import Sweep, sweep_from
from magmotor.sweep.directory import Status, status, sweep_of
from magmotor.sweep.measures import measures
from magmotor.sweep.run import NoWorkers, SweepInterrupted, Tally, run
from magmotor.sweep.worker import OtherVersions

__all__ = [
    "NoWorkers",
    "OtherVersions",
    "Range",
    "Samples",
    "Status",
    "Sweep",
    "SweepInterrupted",
    "Tally",
    "Values",
    "combine",
    "dask_workers",
    "local_cluster",
    "measures",
    "run",
    "status",
    "sweep_from",
    "sweep_of",
]
