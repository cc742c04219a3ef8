"""Steps of many levitated magnets: on `mujoco.batch`, compared with Gymnasium's own vector."""

import gymnasium
import numpy as np

import magmotor.gym  # noqa: F401 - registers the environment
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of

NAME = "magmotor/Levitation-v0"
COUNTS = {8: 1.0, 64: 3.0, 512: 4.0}
"""Numbers of environments, and target ratios."""

STEPS, TURNS = 50, 12
NOTE = """\
A step of one environment, with its share of the resets: `gymnasium.make_vec` on all cores, and with
vectorization_mode="sync". All magnets are let go, and are reset about every 25 steps."""


def main() -> None:
    cases = {}
    for count in COUNTS:
        for mode in ("sync", "vector_entry_point"):
            vector = gymnasium.make_vec(NAME, count, vectorization_mode=mode)
            vector.reset(seed=1)
            actions = np.zeros((count, 1), np.float32)
            cases[count, mode] = lambda v=vector, a=actions: (
                seconds_of(lambda: v.step(a), STEPS) / len(a)
            )
    times = in_turns(cases, TURNS)
    rows = [
        Row(f"{count} magnets", times[count, "sync"], times[count, "vector_entry_point"],
            at_least=target)
        for count, target in COUNTS.items()
    ]  # fmt: skip
    show("Levitation in Gymnasium", NOTE, ("sync", "batch", "ratio"), rows)
