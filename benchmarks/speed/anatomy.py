"""Breakdown of the time of MuJoCo's step, by its own timers."""

import mujoco

import magmotor as mm
from benchmarks.harness.stepping import STEPS, Stepper
from benchmarks.harness.tables import Row, show

TURNS = 40
TIMERS = mujoco.mjtTimer
STAGES = {
    "positions of bodies, geoms, sites": (TIMERS.mjTIMER_POS_KINEMATICS, 2),
    "inertia": (TIMERS.mjTIMER_POS_INERTIA, 2),
    "finding the contact": (TIMERS.mjTIMER_POS_COLLISION, 5),
    "setting up its constraint": (TIMERS.mjTIMER_POS_MAKE, 1),
    "velocities": (TIMERS.mjTIMER_VELOCITY, 1),
    "solving for friction": (TIMERS.mjTIMER_CONSTRAINT, 1),
    "moving on": (TIMERS.mjTIMER_ADVANCE, 1),
}
"""Timers, and the number of clock readings while each runs."""

EMPTY = TIMERS.mjTIMER_POS_PROJECT
"""A stage without work: it takes one reading of the clock."""

NOTE = """\
Bare steps with friction, measured by mjData.timer; the time for reading the clock is
  subtracted. Stages that are equal in both do not make the planar model cheaper."""


def main() -> None:
    steppers = [Stepper(mm.build(mm.Top(surface=s))) for s in ("planar", "plane")]
    turns = [[_seconds_in_timers(stepper) for stepper in steppers] for _ in range(TURNS)]
    read = min(seconds[EMPTY] for turn in turns for seconds in turn)
    rows = []
    for name, (timer, readings) in STAGES.items():
        planar, plane = ([turn[i][timer] - readings * read for turn in turns] for i in (0, 1))
        rows.append(Row(name, planar, plane))
    show("Where the time goes", NOTE, ("planar", "plane", "ratio"), rows)


def _seconds_in_timers(stepper: Stepper) -> list[float]:
    """Return the seconds per step in each of MuJoCo's timers."""
    for timer in stepper.data.timer:
        timer.duration = 0.0
    stepper.seconds(magnetic=False, stopwatch_runs=True)
    return [timer.duration / STEPS for timer in stepper.data.timer]
