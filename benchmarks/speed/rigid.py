"""The reference integrators of rigid bodies: cost of a step, and two threads compared with one."""

from functools import partial

import numpy as np

import magmotor as mm
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of
from magmotor.device.job import Job
from magmotor.devices.ball import rigid_kernel as rigid
from magmotor.devices.motor import variational as motor
from magmotor.devices.motor.device import MOTOR as motor_initial
from magmotor.devices.top import variational as top
from magmotor.devices.top.device import TOP as ball_initial
from magmotor.noise import BrownianPath

STEPS, REPLICAS = 200_000, 8
LONG = 25
"""Factor for the steps of replicas on threads: a second core takes about 0.05 s to wake up."""

SCHEMES = ("euler", "cayley", "baoab")
SLOWEST = 2e-6
"""Seconds per step: half a million steps per second."""


def main() -> None:
    cases = {("the motor", scheme): partial(run_motor, scheme) for scheme in SCHEMES}
    cases |= {("the top", scheme): partial(run_top, scheme) for scheme in SCHEMES}
    threads = {n: partial(run_motor, "baoab", n) for n in (1, 2)}
    times = in_turns(cases, turns=5)
    rows = [
        Row(f"{device}, {scheme}", times[device, scheme], at_most=_target(device, scheme))
        for device, scheme in cases
    ]
    speeds = ", ".join(
        f"{device} by {scheme} {1e-6 / np.median(found):.2g}"
        for (device, scheme), found in times.items()
    )
    note = f"""\
Seconds per step of the kernel, one replica on one thread, with noise where the scene has it.
  Million steps/s: {speeds}."""
    show("Steps of rigid bodies", note, ("median", "", ""), rows)
    both = in_turns(threads, turns=4)
    row = Row("the motor, one thread over two", both[1], both[2], at_least=1.8)
    note = f"{REPLICAS} replicas, per step of one of them. The target is for two idle cores."
    show("Replicas on threads", note, ("one", "two", "ratio"), [row])


def _target(device: str, scheme: str) -> float | None:
    return SLOWEST if (device, scheme) == ("the motor", "baoab") else None


def run_motor(scheme: str, threads: int = 0) -> float:
    """Return the seconds per step of a replica of the motor."""
    scene, h = mm.Motor(), 0.1
    replicas = REPLICAS if threads else 1
    first = motor_initial.initial_state(scene, None, replicas)
    steps = LONG * STEPS // replicas if threads else STEPS
    job = Job(scene, scheme, h, 1, steps, first, BrownianPath(1, h), 0)
    numbers = motor.bodies(scene), motor.magnets(scene), motor.pack(first)
    return _seconds(job, numbers, threads or 1)


def run_top(scheme: str) -> float:
    """Return the seconds per step of the top."""
    scene, h = mm.Top.paper(4), 0.0125
    first = ball_initial.initial_state(scene, None, None)
    job = Job(scene, scheme, h, 1, STEPS, first, BrownianPath(1, h), 0)
    return _seconds(job, (top.bodies(scene), top.magnets(scene), top.pack(first)), 1)


def _seconds(job: Job, numbers: tuple, threads: int) -> float:
    """Return the seconds per step of one replica."""
    seconds = seconds_of(lambda: list(rigid.recorded_chunks(job, *numbers, threads=threads)))
    return seconds / job.record_interval / len(numbers[-1])
