"""Orders of convergence of every method on every scene: against DOP853, and along Brownian paths.

An order is that of the largest error of each recorded quantity, by regression over timesteps. Of
three timesteps at equal ratios, the one between would have no weight in the slope, so that orders 1
and 2 are measured with two, which cannot show whether the line is straight. Orders 4 and 6, which
higher terms bend, have three at unequal ratios, and the slope between neighbors is asserted, too.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

import magmotor as mm
from magmotor.noise import BrownianPath

BALL = ("position", "velocity", "axis", "angular_velocity")
RING = ("ring_axis", "ring_orientation", "ring_angular_velocity")
DISK = ("x", "v", "theta", "omega")

TUMBLING = {
    "ring_axis": [0.14, 0.0, 0.99],
    "ring_angular_velocity": [0.02, 0.03, 0.4],
    "angular_velocity": [1.0, 0.5, 0.3],
}

STEPS = {1: (128, 512), 2: (16, 64), 4: (32, 48, 64), 6: (4, 5, 6)}
"""Steps per record by order; with more steps, rounding and the error of DOP853 are visible."""
MOTOR_STEPS = STEPS | {4: (24, 32, 48), 6: (9, 10, 12)}
WAVE_STEPS = STEPS | {4: (16, 24, 32)}


class Subject(NamedTuple):
    """A scene, the quantities to compare, and the duration and number of records."""

    scene: Any
    quantities: tuple[str, ...]
    duration: float
    interval: float
    steps: dict[int, tuple[int, ...]] = STEPS
    initial: dict[str, Any] | None = None


def top(case, *quantities, duration, **changes):
    return Subject(mm.Top.paper(case, **changes), (*BALL, *quantities), duration, 0.2)


def motor(friction, friction_ring, *quantities):
    scene = mm.Motor(
        temperature="nonuniform", alpha_ring=0.0, friction_ball=friction,
        friction_ring=friction_ring, position=(0.45, 0.2), velocity=(0.02, -0.01),
        axis=(0.3, -0.2, 1.0), spin=0.5,
    )  # fmt: skip
    return Subject(scene, (*BALL, *RING, *quantities), 4.0, 1.0, MOTOR_STEPS, TUMBLING)


def wave(scene, quantities, friction, **changes):
    """A disk or a particle in a potential of three waves."""
    potential = ((0.1, 0.2), (0.3, -0.5), (0.0, 0.3))
    made = scene(noise=0.0, friction=friction, potential=potential, x=0.3, v=0.8, **changes)
    return Subject(made, quantities, 10.0, 0.5, WAVE_STEPS)


# From rest, Euler's velocities would be of second order; conserved quantities show no order.
SUBJECTS = {
    "top": top(4, "momentum_map", duration=20.0),
    "top, no friction": top(2, duration=4.0, spin=2.0, velocity=(0.02, -0.01)),
    "motor": motor(0.15, 0.05, "momentum_map", "heat"),
    "motor, ring free": motor(0.15, 0.0, "momentum_map", "heat"),
    "motor, no friction": motor(0.0, 0.0),
    "disk": wave(mm.Disk, DISK, 0.3, omega=1.0),
    "disk, no friction": wave(mm.Disk, DISK[:2], 0.0, omega=1.0),
    "disk on plane": wave(mm.Disk, DISK, 0.3, omega=1.0, surface="plane"),
    "particle": wave(mm.LangevinParticle, DISK[:2], 0.3),
    "particle, no friction": wave(mm.LangevinParticle, DISK[:2], 0.0),
}

# Columns as in SUBJECTS, 0 for unsupported methods. The comments have the measured orders of the
# quantities that are farthest from theory.
ORDERS = {
    "variational/euler": (1, 1, 1, 1, 1, 1, 1, 0, 1, 1),
    # 1.01 0.96 1.01 0.99 1.00 1.00 1.00 - 1.00 1.00
    "variational/cayley": (1, 1, 1, 1, 1, 0, 0, 0, 0, 0),
    # 0.96 0.96 1.02 1.01 0.99
    "variational/verlet": (2, 2, 2, 2, 2, 2, 2, 0, 2, 2),
    # 2.00 1.97 2.01 2.01 2.01 2.00 2.00 - 2.00 2.00
    "variational/baoab": (2, 2, 2, 2, 2, 2, 2, 0, 2, 2),
    # 2.00 2.06 2.00 2.00 2.00 2.00 2.00 - 2.00 2.00
    "variational/middle": (1, 1, 1, 1, 1, 1, 1, 0, 1, 1),
    # 1.02 0.96 0.99 0.99 1.00 1.00 1.00 - 1.00 1.00
    "variational/blanes-moan4": (4, 4, 4, 4, 4, 4, 4, 0, 4, 4),
    # 3.97 4.09 4.06 4.06 4.08 4.05 4.05 - 3.94 4.05
    "variational/blanes-moan6": (6, 6, 6, 6, 6, 6, 6, 0, 6, 6),
    # 6.08 6.12 6.11 6.16 6.11 5.93 6.01 - 6.02 6.01
    "mujoco/euler": (1, 1, 1, 1, 1, 1, 1, 1, 0, 0),
    # 1.01 0.96 1.00 0.99 1.00 1.00 1.00 1.00
    "mujoco/implicitfast": (1, 1, 1, 1, 1, 1, 1, 1, 0, 0),
    # 1.01 0.96 1.00 0.99 1.00 0.99 1.00 1.00
    "mujoco/rk4": (4, 4, 4, 4, 4, 4, 4, 4, 0, 0),  # since MuJoCo 4
    # 3.91 4.09 3.98 3.98 3.92 3.93 3.91 3.93
    "mujoco/baoab": (2, 2, 2, 2, 2, 2, 2, 0, 0, 0),
    # 2.00 2.06 2.00 2.00 2.00 2.00 2.00
}


def cases(orders, subjects):
    """Return method, name of the subject, and order."""
    return [
        (method, name, order)
        for method, row in orders.items()
        for name, order in zip(subjects, row, strict=True)
        if order
    ]


def known(listed, subject):
    """Return the methods that are listed for a subject."""
    return {method for method, name, _ in listed if name == subject}


CASES = cases(ORDERS, SUBJECTS)


@pytest.mark.parametrize("name", SUBJECTS)
def test_every_method_has_an_order(name):
    assert known(CASES, name) == set(mm.methods(SUBJECTS[name].scene)) - {"scipy/dop853"}


@cache
def truth(name):
    subject = SUBJECTS[name]
    scene = subject.scene
    if isinstance(scene, mm.LangevinParticle):  # a disk with too much inertia to rotate
        scene = mm.Disk(
            sigma=1e30, noise=0.0, friction=scene.friction, potential=scene.potential,
            x=scene.x, v=scene.v,
        )  # fmt: skip
    elif scene.surface == "plane":
        scene = scene.replace(surface="planar")
    return mm.simulate(
        scene, method="scipy/dop853", timestep=subject.interval, duration=subject.duration,
        initial=subject.initial,
    )  # fmt: skip


@pytest.mark.parametrize(("method", "name", "order"), CASES)
def test_order_without_noise(method, name, order):
    """Heat has the order of the motion, but RK4's is summed to second order."""
    subject, exact = SUBJECTS[name], truth(name)
    steps, errors = subject.steps[order], {quantity: [] for quantity in subject.quantities}
    for n in steps:
        run = mm.simulate(
            subject.scene, method=method, timestep=subject.interval / n,
            duration=subject.duration, record_interval=n, initial=subject.initial,
        )  # fmt: skip
        for quantity, values in errors.items():
            values.append(np.abs(run[quantity] - exact[quantity]).max())
    for quantity, values in errors.items():
        measured = -np.polyfit(np.log(steps), np.log(values), 1)[0]
        expected = min(order, 2) if (method, quantity) == ("mujoco/rk4", "heat") else order
        assert abs(measured - expected) < 0.2, (quantity, measured)  # 6.16, the heat of order 6
        slopes = -np.diff(np.log(values)) / np.diff(np.log(steps))
        assert abs(slopes - expected).max() < 0.3, (quantity, slopes)  # 6.18, the same


def test_the_truth_of_the_motor_balances_energy_and_heat():
    run = truth("motor")
    balance = run.energy + run.heat - run.energy[0]
    assert np.abs(balance).max() < 2e-11 * np.abs(run.energy).max()  # 1e-12


NOISY = {
    "disk": Subject(mm.Disk(sigma=0.5, friction=0.5, noise=1.0), DISK, 2.0, 0.5),
    "motor": Subject(
        mm.Motor(position=(0.45, 0.2), velocity=(0.02, -0.01), axis=(0.3, -0.2, 1.0)),
        (*BALL, *RING), 2.0, 0.5, initial=TUMBLING,
    ),
}  # fmt: skip
REPLICAS = {"disk": 1000, "motor": 300}
FACTORS = (16, 64)

# Columns as in NOISY; the comments have the measured orders.
STRONG_ORDERS = {
    "variational/euler": (1, 1),  # 1.01 1.01
    "variational/cayley": (0, 1),  # - 1.02
    "variational/verlet": (1, 1),  # 0.98 1.05
    "variational/baoab": (1, 1),  # 0.98 1.11
    "variational/middle": (1, 1),  # 0.99 0.98
    "mujoco/euler": (1, 1),  # 1.01 1.01
    "mujoco/implicitfast": (1, 1),  # 0.98 1.01
    "mujoco/rk4": (1, 1),  # 0.98 1.03
    "mujoco/baoab": (1, 1),  # 0.98 1.11
}

STRONG_CASES = cases(STRONG_ORDERS, NOISY)


@pytest.mark.parametrize("name", NOISY)
def test_every_method_that_takes_noise_has_a_strong_order(name):
    assert known(STRONG_CASES, name) == set(mm.methods(NOISY[name].scene))


@cache
def along_the_path(method, name, factor):
    """Run with every `factor`-th point of the finest Brownian paths."""
    subject = NOISY[name]
    path = BrownianPath(1, 2.0**-10).coarsened(factor)
    return mm.simulate(
        subject.scene, method=method, timestep=path.timestep, duration=subject.duration,
        replicas=REPLICAS[name], path=path, initial=subject.initial,
        record_interval=round(subject.interval / path.timestep),
    )  # fmt: skip


@pytest.mark.parametrize(("method", "name", "order"), STRONG_CASES)
def test_strong_order(method, name, order):
    """Root mean square error along each replica's Brownian path, in ten batches of replicas.

    1000 or 300 replicas; the bound is four standard errors or more, which order 1 itself exceeds in
    3e-3 of seeds (Student's t, 9 degrees of freedom). The next order moves baoab by 0.11.
    """
    exact = along_the_path("variational/baoab", name, 1)
    runs = [along_the_path(method, name, factor) for factor in FACTORS]
    for quantity in NOISY[name].quantities:
        squares = [((run[quantity] - exact[quantity]) ** 2).values for run in runs]
        means = np.reshape(squares, (len(FACTORS), 10, -1)).mean(axis=-1)
        measured = np.polyfit(np.log(FACTORS), np.log(means) / 2, 1)[0]
        error = measured.std(ddof=1) / np.sqrt(10)
        assert error < 0.15 / 4, quantity  # 0.015, 0.020
        assert abs(measured.mean() - order) < 0.15, quantity  # 0.023, 0.107
