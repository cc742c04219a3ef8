"""The motor with a load, whose work closes the energy balance, and with a chiral ring."""

from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy.spatial.transform import Rotation

import magmotor as mm

QUIET: dict[str, Any] = {"alpha_ball": 0.0, "alpha_ring": 0.0}
TORQUE = 1e-6
EXACT: dict[str, Any] = {"method": "scipy/dop853", "timestep": 1.0}


def angle(run):
    return mm.observables.azimuth(run).values


def test_a_load_alone_gives_its_angular_momentum():
    """Without magnets and friction, rho m v_phi = load x time on the free plane."""
    scene = mm.Motor(
        **QUIET, load_torque=TORQUE, coupling=1e-30, friction_ball=0.0, friction_ring=0.0,
        temperature="nonuniform", position=(0.3, 0.4), velocity=(0.01, -0.003),
    )  # fmt: skip
    for method, timestep, bound in (
        ("scipy/dop853", 1.0, 3e-13),  # 3e-14
        ("variational/middle", 0.5, 3e-13),  # 4e-14
    ):
        run = mm.simulate(scene, method=method, timestep=timestep, duration=40.0)
        (x, y, _), (vx, vy, _) = run.position.values.T, run.velocity.values.T
        gained = scene.ball_mass * (x * vy - y * vx)
        error = gained - gained[0] - TORQUE * run.time.values
        assert np.abs(error).max() < bound * TORQUE * 40.0, method


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_the_load_closes_the_energy_balance(torque):
    """Ball and ring from rest, with friction; the energy knows nothing of the load."""
    scene = mm.Motor(**QUIET, load_torque=torque)
    run = mm.simulate(scene, duration=400.0, **EXACT)
    balance = mm.observables.energy_balance(run)
    turned = angle(run) - angle(run)[0]
    assert turned[-1] * torque > 0
    assert np.abs(turned).max() > 0.05  # 0.07
    np.testing.assert_allclose(balance.load_work, torque * turned, rtol=1e-14)  # 0
    scale = float(balance.load_work[-1])
    assert np.abs(balance.residual).max() < 9e-10 * scale  # 3e-11
    assert np.abs(balance.gain + balance.heat).max() > 0.5 * scale  # 1.03; the null: no load


@pytest.mark.parametrize(("method", "largest"), [("verlet", 1.8e-7), ("baoab", 5.4e-6)])
def test_integrators_converge_to_the_equation_with_a_load(method, largest):
    scene = mm.Motor(**QUIET, load_torque=TORQUE, drag=1e-3, position=(0.5, 0.2))
    exact = mm.simulate(scene, duration=50.0, **EXACT).position
    errors = []
    for n in (8, 16):
        run = mm.simulate(
            scene, method=f"variational/{method}", timestep=1 / n, duration=50.0, record_interval=n
        )
        errors.append(float(abs(run.position - exact).max()))
    assert errors[1] < 3 * largest
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.01, abs=0)  # 3.998


def test_a_load_that_no_well_holds_ends_the_run():
    scene = mm.Motor(**QUIET, load_torque=1e-4)
    with pytest.raises(mm.PhysicalEvent) as stop:
        mm.simulate(scene, method="variational/middle", timestep=0.1, duration=1000.0)
    assert stop.value.event == "ball rolled off"
    assert 1.46 < np.hypot(*stop.value.dataset.position.values[-1, :2]) < 1.47


def test_mujoco_has_no_load():
    scene = mm.Motor(load_torque=TORQUE)
    assert not [name for name in mm.methods(scene) if name.startswith("mujoco")]
    with refused("load_torque"):
        mm.build(scene)
    with refused("method"):
        mm.simulate(scene, method="mujoco/baoab", timestep=0.1, duration=10)


def test_dipoles_are_turned_about_the_axis_of_the_ring():
    scene = mm.Motor(inner_dipoles=7, inner_dipole_angle=0.4)
    turned = Rotation.from_rotvec([0, 0, 0.4]).apply(
        mm.Motor(inner_dipoles=7).inner_dipole_frame()[1]
    )
    np.testing.assert_allclose(scene.inner_dipole_frame()[1], turned, rtol=0, atol=1e-15)  # 1e-16
    np.testing.assert_array_equal(
        scene.inner_dipole_frame()[0], mm.Motor(inner_dipoles=7).inner_dipole_frame()[0]
    )


def test_a_mirror_image_has_the_opposite_chirality():
    """The mirror y -> -y; without turning the dipoles, the null, the motion is another one."""
    start: dict[str, Any] = {
        "position": (0.55, 0.1),
        "velocity": (0.002, 0.01),
        "axis": (0.1, 0.05, 1.0),
    }
    mirrored: dict[str, Any] = {name: (a, -b, *c) for name, (a, b, *c) in start.items()}
    # A reflection also reverses the part of a moment, an axial vector, in its plane. All moments
    # may be reversed at once, so only the part across the plane changes its sign.
    runs = []
    for chirality, begin in ((0.8, start), (-0.8, mirrored), (0.8, mirrored)):
        scene = mm.Motor(**QUIET, inner_dipoles=3, inner_dipole_angle=chirality, **begin)
        runs.append(angle(mm.simulate(scene, duration=100.0, **EXACT)))
    assert np.abs(runs[0] + runs[1]).max() < 1e-14  # 5e-16
    assert np.abs(runs[0] + runs[2]).max() > 0.1  # 0.34


def test_mujoco_turns_the_dipoles_too():
    scene = mm.Motor(inner_dipoles=3, inner_dipole_angle=0.8)
    ends = [
        mm.simulate(scene, method=f"{engine}/baoab", timestep=0.1, duration=50.0, seed=2).position
        for engine in ("mujoco", "variational")
    ]
    assert float(abs(ends[0] - ends[1]).max()) < 1e-14  # 6e-16
