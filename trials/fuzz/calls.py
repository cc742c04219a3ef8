"""Inputs: the call that belongs to a number and a seed."""

from functools import cache
from typing import NamedTuple

import hypothesis
import numpy as np
from hypothesis import strategies as st

from . import values
from .targets import Target, targets

SELDOM = st.sampled_from([False, False, False, True])
ALWAYS = ("executor", "speed", "draws", "samples", "burn_in")
"""Arguments that are always passed, since the defaults are slow or start processes."""
LONG = ("settle", "burn_in", "every", "samples", "replicas")
"""Arguments of thermostats of any model that make a run long, as `nstep` does."""
SLOW = (hypothesis.HealthCheck.too_slow, hypothesis.HealthCheck.large_base_example)


class Call(NamedTuple):
    """An input, as text."""

    seed: int
    number: int
    target: str
    receiver: str | None
    arguments: tuple[tuple[str, str], ...] | None
    """None for a property."""

    def __str__(self) -> str:
        """Return the source text."""
        last = self.target.rsplit(".", 1)[-1]
        called = f"{self.receiver}.{last}" if self.receiver else self.target
        if self.arguments is None:
            return called
        inside = ", ".join(f"{name}={text}" for name, text in self.arguments)
        return f"{called}({inside})"


@cache
def found() -> tuple[list[Target], list[st.SearchStrategy]]:
    """Return all targets, and the strategies of their arguments."""
    every = targets()
    return every, [arguments(target) for target in every]


def call(seed: int, number: int) -> Call:
    """Return the input of a number; the targets take turns."""
    every, strategies = found()
    target = every[number % len(every)]
    receiver, given = drawn(strategies[number % len(every)], f"{seed} {number}")
    return Call(seed, number, target.name, receiver, given)


def drawn(strategy: st.SearchStrategy, seed: str):
    """Return hypothesis's second example for a seed; the first is always the simplest."""
    kept = []

    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=2, phases=[hypothesis.Phase.generate], database=None, deadline=None,
        suppress_health_check=SLOW,
    )  # fmt: skip
    @hypothesis.given(strategy)
    def keep(value):
        kept.append(value)

    keep()
    return kept[-1]


def is_no_long_movie(text: str) -> bool:
    """Whether a speed is invalid, or so high that a movie takes only seconds."""
    try:
        return not 0 < float(eval(text, {"np": np})) < 100
    except Exception:
        return True


def is_no_long_run(text: str) -> bool:
    """Whether a number of steps or replicas is invalid or small."""
    if text == "np.ma.masked":
        return True
    try:
        return not 100 < float(eval(text, {"np": np})) <= 2**53
    except Exception:
        return True


@st.composite
def arguments(draw, target: Target):
    """Valid arguments, usually with one or two hostile ones."""
    kind = draw(st.sampled_from(values.kinds(target.parameters, target.owner)))
    names = [parameter.name for parameter in target.parameters]
    names += ["receiver"] if target.owner else []
    count = draw(st.sampled_from([0, 1, 1, 1, 1, 1, 2, 2]))
    wrong = {draw(st.sampled_from(names)) for _ in range(count if names else 0)}
    receiver = None
    if target.kind == "of the class":
        receiver = target.name.rsplit(".", 1)[0]
    elif target.owner:
        make = values.odd_instance if "receiver" in wrong else values.instance
        receiver = draw(make(target.owner, kind))
    given, name = [], target.name.removeprefix("mm.")
    for parameter in target.parameters:
        if parameter.name in wrong:
            hostile = values.hostile(parameter, name, kind)
            if parameter.name == "speed":
                hostile = hostile.filter(is_no_long_movie)
            if parameter.name == "nstep" or (parameter.name in LONG and kind in values.TREES):
                hostile = hostile.filter(is_no_long_run)
            given.append((parameter.name, draw(hostile)))
        elif (
            parameter.required
            or parameter.name in ALWAYS
            or (parameter.metadata is None and draw(SELDOM))
        ):
            given.append((parameter.name, draw(values.right(parameter, name, kind))))
    return receiver, None if target.kind == "property" else tuple(given)
