"""What `Langevin.sample` is asked for and returns."""

from collections.abc import Sequence

import mujoco
import numpy as np
import xarray as xr

from magmotor.common.arrays import Array
from magmotor.common.checks import check_integer, check_number
from magmotor.common.exceptions import ArgumentError, MagmotorError
from magmotor.mjcf.langevin.relaxation import Sampling
from magmotor.noise import LARGEST_STEP

APPLIED = {
    "ctrl": ("control",),
    "qfrc_applied": ("velocity",),
    "xfrc_applied": ("body", "component"),
}
"""What acts from outside, by its name in mjData, and its dimensions."""


class LangevinDiverged(MagmotorError, FloatingPointError):
    """The motion of a replica could not be followed, was no longer finite, or became huge.

    Attributes
    ----------
    replica : int
        The first such replica.
    time : float
        When it was lost, in s.
    dataset : xarray.Dataset
        Records of all replicas, with NaN where there are none.
    """

    def __init__(self, replica: int, time: float, replicas: int, dataset: xr.Dataset):
        self.replica, self.time, self.dataset = replica, time, dataset
        self._replicas = replicas
        others = f", and {replicas - 1} others later or elsewhere" if replicas > 1 else ""
        when = f"at t = {time:g}" if time > 0 else f"{-time:g} s before the first record"
        super().__init__(
            f"replica {replica} was lost {when}{others}: the timestep is too long (see"
            " largest_timestep, also where limits and contacts act), dipoles came too close to each"
            " other, or nothing bounds the energy from below; `dataset` contains what was recorded"
        )

    def __reduce__(self):
        return type(self), (self.replica, self.time, self._replicas, self.dataset)


def read_sampling(
    timestep: float, duration: float, replicas: int, record_interval: int, burn_in: float
) -> Sampling:
    """Check the numbers of a sample, and return them in steps."""
    h = timestep
    duration = check_number("duration", duration, at_least=h, unit="s (one timestep)")
    nstep = int(duration / h * (1 + 1e-12))
    interval = check_integer("record_interval", record_interval, at_least=1, at_most=nstep)
    burn_in = check_number("burn_in", burn_in, at_least=0, unit="s")
    for name, value in (("duration", duration), ("burn_in", burn_in)):
        if value / h >= LARGEST_STEP:
            raise ArgumentError(name, value, "must be less than 2^53 timesteps")
    return Sampling(
        round(burn_in / h), interval, nstep // interval,
        check_integer("replicas", replicas, at_least=1),
    )  # fmt: skip


def dataset_of(
    records: Array,
    model: mujoco.MjModel,
    baths: Sequence[str],
    every: int,
    initial: mujoco.MjData | None,
    **attributes: str | int,
) -> xr.Dataset:
    """Return the records of `Langevin.sample`, and what acts from outside."""
    nq, nv = model.nq, model.nv
    times = model.opt.timestep * every * np.arange(1, records.shape[1] + 1)
    run = xr.Dataset(
        {
            "qpos": (("replica", "time", "coordinate"), records[:, :, :nq]),
            "qvel": (("replica", "time", "velocity"), records[:, :, nq : nq + nv]),
            "heat": (("replica", "time", "bath"), records[:, :, nq + nv : -1]),
            "work": (("replica", "time"), records[:, :, -1]),
        },
        {"time": times, "bath": [*baths]},
        {"timestep": model.opt.timestep, **attributes},
    )
    for name, axes in APPLIED.items():
        if initial is not None and getattr(initial, name).any():
            run[name] = axes, getattr(initial, name).copy()
    return run
