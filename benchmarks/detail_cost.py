"""What one model's step costs, beside another's."""

from collections.abc import Callable
from functools import partial

import mujoco
from case import Record
from stepping import Stepper
from table import in_turns

TIMESTEP = 0.002


def cost(model: mujoco.MjModel, baseline: mujoco.MjModel, turns: int) -> Record:
    """Of a step by Euler with magnetism; see `beside`."""
    own, other = (
        partial(Stepper(m, timestep=TIMESTEP).seconds, magnetic=True) for m in (model, baseline)
    )
    return beside(own, other, turns)


def beside(own: Callable[[], float], other: Callable[[], float], turns: int) -> Record:
    """Seconds that the first returns, at the least, and how many times the second's they are.

    Measured in turns, so that records made under different loads can be compared.
    """
    times = in_turns({"own": own, "other": other}, turns)
    return {"seconds": min(times["own"]), "ratio": min(times["own"]) / min(times["other"])}
