"""Hostile input gives a named error or a finite result, and the fuzzer finds what does not."""

import os
import sys
import time

import numpy as np

import magmotor as mm
from trials.fuzz import judge, pool
from trials.fuzz.__main__ import fuzz, report
from trials.fuzz.binaries import mutations, try_binaries
from trials.fuzz.calls import Call, call
from trials.fuzz.targets import of_function, targets


def test_200_inputs():
    said = []
    assert fuzz(range(200), seed=1, say=said.append), "\n".join(said)
    print(said[-1])


def planted_error(value):
    return {}[value]


def planted_nan(value):
    return {"deep": [np.array([value, np.nan])]}


def planted_abort(value):
    os.abort()


def planted_sleep(value):
    time.sleep(60)


def planted_warning(value):
    return 0 if np.log(np.array(value)) else 1


def planted_refusal(value):
    mm.noise.BrownianPath(seed=value, timestep=1.0)


def planted_number(value):
    return value


PLANTED = {
    "error": ("raw error", "KeyError"),
    "nan": ("non-finite result", "NaN"),
    "abort": ("crash", "SIGABRT"),
    "sleep": ("hang", "more than 1 s"),
    "warning": ("raw error", "RuntimeWarning"),
    "refusal": ("refused", "ArgumentError"),
    "number": ("result", ""),
}


def judge_planted():
    """As the package's own, of the functions above, which stand for the package."""
    this = sys.modules[__name__]
    judge.material.NAMESPACE["planted"] = this
    every = {f"planted.planted_{name}" for name in PLANTED}
    every = {name: of_function(name, getattr(this, name.split(".")[1])) for name in every}
    return lambda given: judge.judge(given, every[given.target])


def test_planted_bugs_are_found():
    given = [
        Call(1, number, f"planted.planted_{name}", None, (("value", "-1"),))
        for number, name in enumerate(PLANTED)
    ]
    found = list(pool.judged(given, judge_planted, processes=1, limits=(1.0, 2.0, 1.0)))
    told = {one.target: (verdict.kind, verdict.error) for one, verdict in found}
    assert told == {f"planted.planted_{name}": verdict for name, verdict in PLANTED.items()}
    where = {one.target: verdict.place for one, verdict in found}
    assert "test_fuzz.py" in where["planted.planted_abort"]
    said = []
    assert not report(found, said.append)
    assert said[-1] == (
        "7 inputs: 1 crashes, 1 hangs, 2 raw errors, 1 non-finite results"
        " (1 refused, 0 documented errors, 1 results)"
    )


def test_a_number_and_a_seed_determine_the_input():
    assert [call(3, n) for n in (7, 700)] == [call(3, n) for n in (7, 700)]
    assert len({str(call(seed, 7)) for seed in range(9)}) > 4


def test_the_whole_public_interface_is_called():
    names = [target.name for target in targets()]
    for name in (*mm.theory.__all__, *mm.observables.__all__):
        of_results = name in ("CriticalPoint", "MotorWells")  # tuples without methods
        assert of_results or any(found.split(".")[2:3] == [name] for found in names)


def test_damaged_binaries_crash_no_process():
    """See `python -m trials.fuzz` for more."""
    said = []
    assert try_binaries(mutations(60, seed=1), said.append), "\n".join(said)
    print(said[-1])
