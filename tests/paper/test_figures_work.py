"""Figures of the motor's work: laws that must fail for what does not obey them."""

import numpy as np
import pytest

from magmotor.devices.motor.scene import Motor
from paper.motor import two_temperatures, work
from paper.motor.two_temperatures import Flow, TwoTemperatures
from paper.motor.work import Load
from paper.motor.work_law import log_ratios, slope_of_the_law

REPLICAS = 400


def test_the_slope_is_that_of_a_gaussian_law():
    """Of a Gaussian x, ln P(x)/P(-x) = 2 mean/variance x; 4 standard errors, false alarm 6e-5.

    The sample size is 20 000, the number of laws 3.
    """
    rng = np.random.default_rng(1)
    for slope in (0.5, 1.0, 2.0):
        x = rng.normal(0.6, np.sqrt(1.2 / slope), (2000, 10))
        found = slope_of_the_law(x)
        assert abs(found.value - slope) < 4 * found.error
        assert found.error < 0.03 * slope  # 0.016 to 0.023
        mean, ratio, error = log_ratios(x.ravel(), np.linspace(0, 3, 7))
        assert np.abs((ratio - slope * mean) / error).max() < 4


def test_the_error_of_the_slope_knows_what_replicas_share():
    """Five copies of each sample have the error of one."""
    x = np.random.default_rng(2).normal(0.5, 1.0, (300, 1))
    one, copies = slope_of_the_law(x), slope_of_the_law(np.repeat(x, 5, axis=1))
    assert copies.value == pytest.approx(one.value, rel=1e-9, abs=0)  # 0
    assert copies.error == pytest.approx(one.error, rel=1e-9, abs=0)  # 0


def walkers(drift: float = 1.0, heated: float = 1.0) -> Load:
    """Overdamped walkers under loads, for which every claim is exact.

    `drift` multiplies Einstein's mobility, and `heated` the diffusion under a load.
    """
    rng = np.random.default_rng(3)
    kT, diffusion, times = Motor().kT, 0.05, np.arange(0, 20100, 100.0)
    torque = np.array([-1e-7, 1e-7, 2e-7])
    steps = rng.normal(0, 1, (4, REPLICAS, len(times) - 1)) * np.sqrt(2 * diffusion * 100)
    wander = np.concatenate([np.zeros((4, REPLICAS, 1)), steps.cumsum(axis=-1)], axis=-1)
    pulled = drift * diffusion / kT * torque[:, np.newaxis, np.newaxis] * times
    return Load("", kT, times, torque, np.sqrt(heated) * wander[1:] + pulled, wander[0])


def verdicts(found):
    return [claim.verdict for claim in found]


def test_a_walker_in_equilibrium_obeys_all_laws_of_the_load():
    assert verdicts(work.claims(walkers())) == ["right"] * 3


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (walkers(drift=0.5), ["wrong", "right", "wrong"]),  # as if kT were alpha^2/c
        (walkers(heated=2.0), ["right", "right", "wrong"]),
        (walkers(drift=-1.0), ["wrong", "wrong", "wrong"]),  # it lifts the load
        (walkers(drift=0.0), ["wrong", "wrong", "wrong"]),
    ],
    ids=["twice the temperature", "diffusion of twice the temperature", "lifts the load", "inert"],
)
def test_what_breaks_a_law_of_the_load_is_found(data, expected):
    assert verdicts(work.claims(data)) == expected


def flows(
    *,
    backward: bool = False,
    leak: float = 0.0,
    lost: float = 0.0,
    current: float = 0.0,
    lifted: float = 1.0,
) -> TwoTemperatures:
    """Made-up flows: heat of 2e-10 W per temperature, and speeds of 1e-5 rad/s by chance.

    `lost` is the share of the heat that does not arrive.
    """
    rng = np.random.default_rng(4)

    def flow(ratio: float, speed: float, warm: float = 1.0) -> Flow:
        heat = 2e-10 * (ratio - 1) * (-1 if backward else 1) + leak
        noise = rng.normal(0, 1e-11 * ratio, 64)
        taken = (1 - lost) * heat + rng.normal(0, 1e-10, 64)
        return Flow(warm * heat + noise, taken, speed + rng.normal(0, 1e-5, 64), 3e-3)

    ratios = (0.25, 1.0, 4.0)
    pushed = 1e-3 * lifted
    return TwoTemperatures(
        "", Motor().kT, ratios, tuple(flow(r, current * (r > 1)) for r in ratios),
        flow(4.0, -current), (flow(4.0, -pushed), flow(4.0, pushed)),
        (flow(1.0, -1e-3), flow(1.0, 1e-3)),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (flows(), ["right"] * 5),
        (flows(backward=True), ["wrong", *["right"] * 4]),
        (flows(lost=1.0), ["wrong", *["right"] * 4]),
        (flows(leak=1e-10), ["right", "wrong", "right", "right", "right"]),
        (flows(current=1e-4), ["right", "right", "right", "wrong", "right"]),
        (flows(lifted=-1.0), ["right", "right", "right", "right", "wrong"]),
    ],
    ids=[
        "all hold",
        "heat from cold to hot",
        "lost",
        "heat at one temperature",
        "ratchet",
        "lifts",
    ],
)
def test_what_breaks_a_law_of_two_temperatures_is_found(data, expected):
    assert verdicts(two_temperatures.claims(data)) == expected
