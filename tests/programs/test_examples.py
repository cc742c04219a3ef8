"""The examples: physics against theory, pictures, and the quotes in the documentation."""

import importlib
import re
import sys
from pathlib import Path
from typing import Any

import magpylib
import mujoco
import mujoco.batch
import numpy as np
import pytest
from brief_runs import BRIEF
from matplotlib.figure import Figure
from PIL import Image

import magmotor as mm

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
PAGE = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")


@pytest.fixture
def example(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    return importlib.import_module


@pytest.fixture
def pendulum(example):
    return example("magnetic_pendulum").Pendulum()


def colors(path):
    with Image.open(path) as picture:
        return np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)


@pytest.mark.parametrize(("mode", "signs"), [(0, (1, 1)), (1, (1, -1))])
def test_needles_swing_at_the_frequencies_of_theory(example, mode, signs):
    needles = example("compass_needles")
    model = needles.load()
    rest, frequencies = needles.rest_angle_and_frequencies(model)
    errors = []
    for push in (1e-2, 1e-3):
        time, path = needles.swing(model, rest + push * np.array(signs), 5.0)
        measured = needles.frequency(time, path[:, 0] - rest)
        errors.append(abs(measured / frequencies[mode] - 1))
    assert errors[0] < 2e-4  # 8.3e-5, 8.6e-5: swings of finite width
    assert errors[1] < 2e-5  # 9.3e-6, 8.1e-6


def test_needles_come_to_rest_between_head_to_tail_and_north(example):
    needles = example("compass_needles")
    model = needles.load()
    rest, _ = needles.rest_angle_and_frequencies(model)
    _, path = needles.swing(model, np.radians((75, -60)), 40.0)
    assert 0.4 < rest < 0.5  # 0.432: neither
    assert path[-1] == pytest.approx(rest, abs=5e-6)  # 3e-7


def test_needles_without_the_earth_swing_with_ratio_of_root_three(example):
    needles = example("compass_needles")
    model = needles.load()
    model.site("earth").user[0] = 0
    model.dof_damping[:] = 0
    rest, _ = needles.rest_angle_and_frequencies(model)
    assert rest == 0
    swings = [needles.swing(model, np.multiply(1e-3, signs), 5.0) for signs in ((1, 1), (1, -1))]
    in_step, against = (needles.frequency(time, path[:, 0]) for time, path in swings)
    assert abs(in_step / against / np.sqrt(3) - 1) < 2e-9  # 7e-11


def test_basins_have_the_symmetry_of_the_magnets(example, pendulum):
    x, y = np.random.default_rng(1).uniform(-0.2, 0.2, (2, 400))
    turn = np.exp(2j * np.pi / 3 * np.arange(3))[:, None] * (x + 1j * y)
    ends = example("magnetic_pendulum").release(pendulum, turn.real.ravel(), turn.imag.ravel())
    assert (ends.magnet >= 0).all()
    turned_back = (ends.magnet.reshape(3, -1) - np.arange(3)[:, None]) % 3
    agree = np.mean((turned_back == turned_back[0]).all(axis=0))
    assert agree > 0.98  # 1.0
    mirrored = example("magnetic_pendulum").release(pendulum, x, -y)
    agree = np.mean(mirrored.magnet == -ends.magnet[:400] % 3)
    assert agree > 0.98  # 1.0
    shares = np.bincount(turned_back[0], minlength=3) / 400
    assert shares.min() > 0.2  # 0.28: no magnet is left out


def test_basins_are_the_same_on_any_number_of_threads(example, pendulum):
    module = example("magnetic_pendulum")
    one, two = (module.release(pendulum, *module.grid(16, 0.3), threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.magnet, two.magnet)
    np.testing.assert_array_equal(one.time, two.time)


def test_basins_hardly_change_with_half_the_timestep(example, pendulum):
    module = example("magnetic_pendulum")
    coarse = module.release(pendulum, *module.grid(30, 0.3))
    pendulum.model.opt.timestep /= 2
    fine = module.release(pendulum, *module.grid(30, 0.3))
    changed = np.mean(coarse.magnet != fine.magnet)
    assert changed < 0.02  # 0.0044


def test_energy_of_the_pendulum_decreases_and_it_stays_where_it_was_captured(example, pendulum):
    x, y = np.array([0.21]), np.array([0.13])
    ends = example("magnetic_pendulum").release(pendulum, x, y)
    data = mujoco.MjData(pendulum.model)
    data.qpos[:] = pendulum.orientations(x, y)[0]
    mujoco.mj_kinematics(pendulum.model, data)
    assert data.site("bob").xpos[:2] == pytest.approx([0.21, 0.13], abs=1e-15)  # 0, or rounding
    energies = []
    with mm.magnetism():
        for _ in range(6000):
            mujoco.mj_forward(pendulum.model, data)
            bob = data.site("bob").xpos[None]
            energies.append(data.energy.sum() + pendulum.magnetic_energy(bob)[0])
            mujoco.mj_step(pendulum.model, data)
    energies = np.array(energies)
    lost = energies[0] - energies[-1]
    assert lost > 0.01  # 0.022 J
    assert np.diff(energies).max() < 1e-14  # -1e-12 J
    caught = round(ends.time[0] / pendulum.model.opt.timestep)
    assert energies[caught] < pendulum.barrier() < energies[caught - 11]
    magnet = pendulum.magnets[ends.magnet[0], :2]
    assert (
        np.linalg.norm(data.site("bob").xpos[:2] - magnet) < 0.03
    )  # 0.0165: gravity pulls it inwards


def test_someone_elses_pole_stays_where_the_torques_balance(example):
    pole = example("someone_elses_model")
    model = pole.load()
    expected = pole.equilibrium(model)
    with mm.magnetism():
        _, angle = pole.swing(model, 80.0)
    assert angle[-1] == pytest.approx(expected, abs=2e-7)  # 1e-8
    assert pole.torque(model, expected - 0.01) > 1  # 8.2 N m: it is stable
    assert pole.torque(model, expected + 0.01) < -1  # -7.4 N m
    _, angle = pole.swing(pole.load(magnetized=False), 80.0)
    assert angle[-1] == pytest.approx(np.pi, abs=5e-6)  # 3e-7


@pytest.mark.parametrize(
    ("name", "numerics"),
    [
        ("compass_needles", {"duration": 4.0}),
        ("magnetic_pendulum", {"pixels": 12}),
        ("someone_elses_model", {"duration": 4.0}),
    ],
)
def test_pictures_are_written_and_not_blank(example, tmp_path, capsys, name, numerics):
    out = tmp_path / "new" / "picture.png"
    example(name).main(out=out, **numerics)
    assert f"wrote {out}" in capsys.readouterr().out
    assert len(colors(out)) > 50  # 150 or more


def cosines_of_a_chain(chain, model, count, exponents):
    """Mean cosines of links to the vertical, then to the next, by weighted draws, and errors.

    The weights are these powers of det M.
    """
    length, links = -model.body("link 2").pos[2], model.njnt
    mass, spin = model.body_mass[1], model.body_inertia[1, 0]
    x = np.arange(links, 0, -1) * mass * 9.81 * length / chain.KT
    random = np.random.default_rng(3)
    u = random.uniform(size=(count, links))
    cosine = np.log(np.exp(-x) + u * (np.exp(x) - np.exp(-x))) / x
    turn, sine = random.uniform(0, 2 * np.pi, u.shape), np.sqrt(1 - cosine**2)
    u = np.stack([sine * np.cos(turn), sine * np.sin(turn), -cosine], axis=-1)
    # Inertia for the angular velocities of the links: m l^2 (n - max(j, k)) (u_j.u_k - u_k u_j^T).
    dots = np.einsum("tja,tka->tjk", u, u)
    later = mass * length**2 * (links - np.maximum.outer(np.arange(links), np.arange(links)))
    inertia = np.einsum("tjk,ab->tjakb", dots, np.eye(3)) - np.einsum("tka,tjb->tjakb", u, u)
    inertia *= later[:, None, :, None]
    inertia = inertia.reshape(count, 3 * links, 3 * links) + spin * np.eye(3 * links)
    logarithm = np.linalg.slogdet(inertia)[1]
    values = np.hstack([cosine, np.diagonal(dots, 1, 1, 2)])
    for exponent in exponents:
        weight = np.exp(exponent * logarithm)
        weight /= weight.sum()
        mean = weight @ values
        yield mean, np.sqrt(weight**2 @ (values - mean) ** 2)


def test_the_chain_has_the_temperature_and_the_law_of_boltzmann(example):
    # 15 cosines and 9 temperatures from 16 replicas of 200 records: one in 250 seeds fails.
    chain = example("thermal_chain")
    model = chain.load()
    run = chain.sample(model, 10.0)
    links = chain.directions(model, run.qpos.values)
    next_ones = np.sum(links[:, :, 1:] * links[:, :, :-1], axis=-1)
    each = np.concatenate([-links[..., 2], next_ones], axis=-1).mean(axis=1)
    mean, error = each.mean(axis=0), each.std(axis=0, ddof=1) / 4
    laws = cosines_of_a_chain(chain, model, 10_000, (0.5, 0.0))
    right, wrong = [(abs(mean - law) / np.hypot(error, other)).max() for law, other in laws]
    assert right < 5 < wrong  # 1.6; 6.9 without the factor; 9.6 at 1.2 kT
    kinetic = mm.kinetic_temperature(model, run)
    off = abs(kinetic.temperature / chain.KT - 1) / (kinetic.error / chain.KT)
    assert off.max() < 5  # 1.1
    assert abs(kinetic.total - chain.KT) < 5 * kinetic.total_error  # 1.0, of an error of 1 %


def test_the_links_of_the_picture_without_the_factor_obey_the_law_of_langevin(example):
    # Errors of the means of 100 000 draws: one in 10 000 seeds fails.
    chain = example("thermal_chain")
    x = chain.weights(chain.load())
    cosine = -chain.freely_jointed(x, 100_000)[..., 2]
    off = abs(cosine.mean(axis=1) - (1 / np.tanh(x) - 1 / x)) / (cosine.std(axis=1) / 100_000**0.5)
    assert off.max() < 4.3  # 0.7


def test_the_beads_fold_as_they_cool_and_open_again(example):
    beads = example("magnetic_beads")
    model = beads.load()
    strings = beads.fold(model, 0.3, 4)
    late = strings.isel(record=slice(beads.SETTLED, None)).mean(("replica", "record"))
    hot, cold, again = late.radius.values[[0, 9, 18]]
    assert cold < 0.6 * hot  # 0.48
    assert again > 0.8 * hot  # 1.01
    touching = 2e-7 * 0.4**2 / 0.016**3  # energy of two beads head to tail
    assert late.energy.values[9] < -6 * touching  # -9.9
    data = mujoco.MjData(model)
    data.qpos[:] = strings.qpos.values[0, 9, -1]
    langevin = mm.Langevin(model, kT=beads.COOLING[-1], seed=8)
    assert langevin.largest_timestep(data) > 1.3 * model.opt.timestep  # 2.0
    # 8 replicas of 100 records: one in 1000 seeds fails.
    run = langevin.sample(
        1000 * langevin.timestep,
        replicas=8,
        record_interval=10,
        burn_in=400 * langevin.timestep,
        initial=data,
    )
    kinetic = mm.kinetic_temperature(model, run)
    assert abs(kinetic.total - 5e-4) < 5 * kinetic.total_error  # 0.02, of an error of 2 %


@pytest.fixture(scope="module")
def arm():
    """The example, and its runs with MuJoCo's default contacts and with those of mm.check."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLES)
        module = importlib.import_module("pick_and_place")
    model = module.load()
    with pytest.warns(UserWarning, match=r"mm.check\(model\) proposes"):
        thrown = module.perform(model)
    mm.check(model, module.start(model), fix=True)
    return module, model, module.perform(model), thrown


def test_the_arm_picks_up_carries_and_lets_go(arm):
    module, model, run, _ = arm
    radius = model.geom("pellet").size[0]
    held = run.sel(time=slice(*module.HELD))
    assert -0.05 < held.gap.min() / radius < 0  # -0.017
    assert held.gap.max() < 0
    assert np.ptp(held.gap.values) < 1e-3 * radius  # 9e-5: it stays where it is
    before, after = run.sel(time=slice(None, 2)), run.sel(time=slice(8.3, None))
    assert np.ptp(before.height.values) < 1e-4  # 6e-6: it lies on its post
    assert after.force.max() < 3e-10  # 1e-11 N: the current has gone
    bowl = model.body("bowl").pos
    place = after.qpos.values[:, :2] - bowl[:2]
    assert np.linalg.norm(place, axis=1).max() < 0.04  # 0.030: it rolls in the bowl
    assert run.height[-1] == pytest.approx(0.016, abs=1e-4)  # 1e-5: on its floor
    assert run.speed[-1] < 3e-10  # 1e-11


def test_the_pellet_is_held_by_the_force_of_a_dipole_on_an_iron_sphere(arm):
    """The series of multipoles of a sphere; the model's nodes are within a few percent of it."""
    module, model, run, _ = arm
    radius, chi, n = model.geom("pellet").size[0], 5000, np.arange(1, 300)
    face, coil = (model.site(f"hand/{name}").pos[2] for name in ("face", "coil"))
    held = run.sel(time=slice(2.6, module.HELD[1]))
    distance = ((face - coil + radius + held.gap) / radius).values[:, None]
    response = n * chi / (n * chi + 2 * n + 1)
    terms = response * (n + 1.0) ** 2 * (2 * n + 4) * distance ** -(2.0 * n + 5)
    force = 5e-8 * (2 * held.current) ** 2 / radius**4 * terms.sum(axis=1)
    np.testing.assert_allclose(held.force, force, rtol=0.1)
    weight = model.body("pellet").mass[0] * 9.81
    assert 45 < held.force.min() / weight < 60  # 54


def test_with_default_contacts_the_pellet_is_thrown(arm):
    module, model, _, thrown = arm
    assert thrown.speed[-1] > 10  # 436 m/s, which rounding changes
    assert 2.05 < thrown.time[-1] < 2.15
    assert mm.check(module.load(), fix=True).findings
    assert not mm.check(model, module.start(model)).findings


@pytest.fixture(scope="module")
def gripper():
    """The example, its model, the pull while it holds the plate (N), and the runs of the page."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLES)
        module = importlib.import_module("magnetic_gripper")
    model = module.load()
    pull = module.hanging(module.carry(model, 5.0)).pull.values[0]
    limit = module.largest_acceleration(model, pull)
    return module, model, pull, [module.carry(model, part * limit) for part in module.FRACTIONS]


def test_the_gripper_pulls_the_plate_like_thick_iron(gripper):
    """A magnet and its mirror image: near it, a plate of 4 mm is thick."""
    module, model, _, _ = gripper
    gaps = module.GAPS[:6]
    magnet = magpylib.magnet.Cylinder(dimension=(0.008, 0.005), polarization=(0, 0, 1.3))
    image = magnet.copy()
    for gap, pull in zip(gaps, module.pulls(model, gaps), strict=True):
        magnet.position, image.position = (0, 0, gap + 0.0025), (0, 0, -gap - 0.0025)
        force: Any = magpylib.getFT(image, magnet, meshing=2000)
        assert pull == pytest.approx(-force[0][2] * 1000 / 1002, rel=5e-3)  # 2.4e-4
    weight = 0.08 * 0.06 * 0.004 * 7850 * 9.81
    strong, weak = module.pulls(model, module.GAPS[[0, -1]]) / weight
    assert strong > 5 > 0.01 > weak  # 5.5, 0.005


def test_friction_holds_the_plate_up_to_the_acceleration_of_theory(gripper):
    module, model, pull, (held, slips, falls) = gripper
    assert 0.3 * (pull / (0.08 * 0.06 * 0.004 * 7850) - 9.81) == pytest.approx(
        module.largest_acceleration(model, pull), rel=5e-15
    )  # 2e-16
    part = module.hanging(held)
    assert np.ptp(part.slip.values) < 5e-4  # 0.27 mm: soft friction creeps
    assert np.ptp(module.hanging(slips).slip.values) > 1e-3  # 2.1 mm
    assert module.outcome(falls) == "falls"


def test_the_gripper_sets_the_plate_down_and_lets_go(gripper):
    module, _, _, (held, _, _) = gripper
    place = held.qpos.values[-1, :3]
    assert place == pytest.approx([module.ACROSS, 0, 0.022], abs=1e-5)  # 4e-7
    assert abs(held.pull[-1]) < 9e-6  # 3e-7 N
    assert held.height.max() > 0.1  # 0.12 m: it was lifted


def test_the_pull_of_the_box_on_the_robot(example):
    """By boundary elements; a wall without edges would attract it with 55.0 N."""
    module = example("climbing_robot")
    assert module.pull(module.load()) == pytest.approx(52.4, rel=0.06)  # 0.049


def test_strong_wheels_pass_the_edges_and_weak_ones_fall(example):
    module = example("climbing_robot")
    strong, middle, weak = (module.drive(module.load(value)) for value in module.MAGNETS.values())
    assert strong.normal[-1].all()
    assert strong.qpos[-1, 0] == pytest.approx(0.124, abs=1e-3)  # on the other side of the box
    assert strong.qpos[:, 2].max() > 0.15  # 0.154 m: it was on the top
    side = slice(0.1, 0.2)
    per_wheel = strong.normal.sel(time=side).mean(("time", "wheel"))
    assert 4 * per_wheel == pytest.approx(module.pull(module.load()), rel=0.05)  # 0.008
    front = strong.normal.sel(wheel=["front left", "front right"]).mean("wheel")
    at_edge = front.sel(time=slice(0.2, 0.8)).min()
    assert at_edge < 0.3 * front.sel(time=side).mean()  # 0.10
    assert weak.time[-1] < 1.5  # 0.50 s
    pulls = [module.pull(module.load(value)) for value in module.MAGNETS.values()]
    needed = module.needed(module.load())
    assert pulls[2] < needed < pulls[1]  # 4.7, 7.4, 12.5 N
    assert 0.65 < middle.time[-1] < 1.5  # 0.90 s: it tips over backward at the edge
    assert middle.qpos[:, 2].max() > 0.095  # 0.115 m: after it has climbed the side
    assert middle.qpos[:, 0].max() < -0.01  # -0.019 m: it never passes the edge
    assert module.outcome(middle) == "falls off after 0.90 s"


def test_the_closed_forms_of_chains_and_rings_are_those_of_the_dipoles(example):
    beads = example("magnetic_assembly")
    model = beads.load()
    n, data = model.nq // 3, mujoco.MjData(model)
    start = model.body_pos[-n:, :2]
    turn = 2 * np.pi * np.arange(n) / n
    radius = 0.005 / np.sin(np.pi / n)
    circle = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1), turn + np.pi / 2
    line = 0.01 * np.stack([np.arange(n), np.zeros(n)], axis=1), np.zeros(n)
    for law, (place, angle) in ((beads.chain, line), (beads.ring, circle)):
        data.qpos[:] = np.concatenate([place - start, angle[:, None]], axis=1).ravel()
        mujoco.mj_kinematics(model, data)
        energy = mm.magnetic_energy(model, data)
        assert energy == pytest.approx(law(n) * beads.unit_energy(model), rel=9e-15)  # 3e-16
        (piece,) = beads.pieces(model, data.qpos)
        assert piece.closed == (law is beads.ring)
        assert piece.energy == pytest.approx(energy, rel=9e-15)  # 3e-16
    assert beads.ring(3) > beads.chain(3)
    assert beads.ring(4) < beads.chain(4)  # from four beads on, rings are lower


def test_the_beads_assemble_into_chains_and_rings(example):
    beads = example("magnetic_assembly")
    model = beads.load()
    motion = beads.assemble(model, 1.5, 3)
    n, u = model.nq // 3, beads.unit_energy(model)
    first, *_, last = zip(*beads.measure(model, motion), strict=True)
    assert [len(pieces) for pieces in first] == [n] * 3
    assert max(len(pieces) for pieces in last) < n / 4  # 7
    kT = 2 * u / beads.COLDNESS
    for pieces in last:
        energy = sum(piece.energy for piece in pieces) / n
        law = u * sum((beads.ring if p.closed else beads.chain)(len(p.beads)) for p in pieces) / n
        assert 0 < energy - law < 3 * kT  # 0.2 to 0.6: an open chain bends
    late = motion.isel(time=slice(40, None))
    # 3 replicas of 120 records: one in 1000 seeds fails.
    kinetic = mm.kinetic_temperature(model, late)
    assert abs(kinetic.total - kT) < 5 * kinetic.total_error  # 0.5, of an error of 1.1 %


def test_the_levitated_ball_has_the_exponents_of_theory(example):
    """A falling exponent and its opposite; swings and tilts to the sides; the coil; a free spin.

    The energy of displacements x, z and of a tilt t is W (x^2/d - 2 z^2/d + d t^2/6 + x t/2).
    """
    levitation = example("levitation")
    model = levitation.load()
    h, d, g = model.opt.timestep, 0.04, 9.81
    found = levitation.rates(levitation.linearize(model)[0], h)
    found = found[np.lexsort((found.imag, found.real.round(6)))]
    leaves = 2 / h * np.arcsinh(h * np.sqrt(g / d))
    gyration = 0.4 * 0.006**2
    stiffness = g * np.array([[2 / d, 1 / 2 / gyration**0.5], [0, d / 3 / gyration]])
    stiffness[1, 0] = stiffness[0, 1]
    swings = 2 / h * np.arcsin(h / 2 * np.sqrt(np.linalg.eigvalsh(stiffness)))
    middle = [*-swings[::-1].repeat(2), 0, 0, *swings.repeat(2)]
    expected = [-200, -leaves, *(1j * np.array(middle)), leaves]
    assert abs(found - expected).max() < 1e-6  # 8e-8, of up to 200


def test_the_controller_makes_the_levitated_ball_stable(example):
    """All but the swings and the spin, which nothing damps, decay; the matrix is right."""
    levitation = example("levitation")
    model = levitation.load()
    together = levitation.closed_loop(model)
    exponents = levitation.rates(together, model.opt.timestep)
    undamped = abs(exponents.real) < 1e-6
    assert undamped.sum() == 10
    assert exponents.real[~undamped].max() < -50  # -68.6
    data, held = mujoco.MjData(model), levitation.Controller(model)
    current = levitation.holding_current(model, 0.0)
    data.act[:] = data.ctrl[:] = held.command = current
    held.state = np.array([0, 0, current])
    data.qpos[2] = 1e-6
    state = np.zeros(16)
    state[2] = 1e-6
    furthest = errors = 0.0
    for _ in range(60):
        mujoco.mj_step(model, data)
        data.ctrl[:] = held(*data.sensordata[2:], 0.0)
        state = together @ state
        errors = max(errors, abs(data.qpos[2] - state[2]))
        furthest = max(furthest, abs(state[2]))
    assert errors < 3e-3 * furthest  # 1.2e-4: 1 um is not infinitely small
    assert abs(state[2]) < 0.01 * furthest


def test_the_ball_follows_its_set_points_and_withstands_the_push(example):
    levitation = example("levitation")
    path = levitation.hold(levitation.load(), 2.2)
    height = path.qpos[:, levitation.HEIGHT]
    for begin, end in ((0.1, 0.3), (0.5, 0.9), (1.1, 1.5), (1.7, 2.2)):
        late = path.sel(time=slice(begin, end - 1e-3))
        error = height.sel(time=late.time) - late.target
        swinging = begin > 1.5
        assert abs(error).max() < (1e-3 if swinging else 3e-4)  # 0.24 mm, 0.06 mm
    quiet = slice(0.1, 0.29)
    assert abs(path.estimate - height).sel(time=quiet).std() < 1e-4  # 1.6e-5
    assert abs(height).max() < 0.009  # 7.2 mm: it is not lost
    assert abs(path.qpos[:, 0]).max() > 1e-3  # 1.5 mm: the push is oblique


def washboard(tilt, limit, diffusion, nodes=400):
    """The mean rotation by Stratonovich's double integral."""
    x = np.arange(nodes)[:, None] * 2 * np.pi / nodes
    y, weights = np.polynomial.legendre.leggauss(nodes)
    y = np.pi * (y + 1)
    exponent = (-tilt * y + limit * (np.cos(x) - np.cos(x - y))) / diffusion
    integral = 2 * np.pi**2 * np.exp(exponent).mean(axis=0) @ weights
    return tilt - 2 * np.pi * diffusion * -np.expm1(-2 * np.pi * tilt / diffusion) / integral


def test_the_cold_screw_steps_out_at_the_closed_form(example):
    """In step at 0.995 of mB/resistance; above, turns are lost at the rate of theory."""
    swimmer = example("micro_swimmer")
    model = swimmer.load(kT=0.0)
    limit = swimmer.step_out(model)
    assert limit == pytest.approx(60 / 8160, rel=1e-15)
    fractions = np.array([0.5, 0.995, 1.005, 1.01, 1.1])
    path = swimmer.swim(model, fractions * limit, 800 / limit)
    found = swimmer.rotation(path) / limit
    assert found[:2] == pytest.approx(fractions[:2], rel=1e-3)  # 2e-7, 1.2e-4
    lost = (fractions - found)[2:]
    steps_out = np.sqrt(fractions[2:] ** 2 - lost**2)
    assert steps_out == pytest.approx(1, abs=5e-3)  # 5e-4, 5e-5, 1.6e-3: a turn more or less
    swum = (path.along[-1] / (path.turn[-1] - path.turn[0])).values
    assert swum == pytest.approx(0.086, rel=3e-4)  # 1.6e-5


def test_the_warm_screw_rotates_as_in_a_washboard(example):
    """Six frequencies, 32 screws each: one in 4000 seeds fails by chance."""
    swimmer = example("micro_swimmer")
    model = swimmer.load()
    limit, diffusion = swimmer.step_out(model), swimmer.KT / 8160
    fractions = np.array([0.3, 0.8, 0.95, 1.05, 1.2, 1.6])
    theory = [swimmer.rotation_in_theory(f * limit, limit, diffusion) / limit for f in fractions]
    integral = [washboard(f * limit, limit, diffusion) / limit for f in fractions]
    assert theory == pytest.approx(integral, rel=1e-10)  # 5e-12
    path = swimmer.swim(model, np.repeat(fractions * limit, 32), 150 / limit)
    each = swimmer.rotation(path).reshape(6, 32) / limit
    mean, error = each.mean(axis=1), each.std(axis=1, ddof=1) / np.sqrt(32)
    assert error.max() < 0.02  # 0.013
    assert abs((mean - theory) / error).max() < 4.5  # 1.2
    cold = fractions - np.sqrt(np.maximum(fractions**2 - 1, 0))
    assert abs((mean - cold) / error)[1:4].min() > 4.5


def test_the_screw_has_its_field_in_its_own_units(example):
    """60e-18 A m^2 on the axis, 5 um away: 9.6e-8 T, in mT; the fields of the coils are off."""
    model = example("micro_swimmer").load()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = mm.field(model, data, data.site("magnet").xpos + np.array([0, 5, 0]))
    expected = 1e3 * 2e-7 * 60e-18 / 5e-6**3
    assert found == pytest.approx([0, expected, 0], rel=1e-10, abs=3e-19)  # 3e-11, 1e-20


def test_the_screw_has_the_temperature_of_the_water(example):
    """Diffusion without a field, 400 screws: one in 1e5 seeds fails by chance."""
    swimmer = example("micro_swimmer")
    model = swimmer.load()
    model.site("magnet").user[0] = 1e-9
    found = mm.describe(model)
    assert "temperature: kT = 4.11 J" in str(found)
    batch = mujoco.batch.Batch(model, 400)
    batch.userdata[:, 0], batch.userdata[:, 1] = 5, np.arange(400)
    batch.step(nstep=200)
    time = 200 * model.opt.timestep
    slip = batch.qpos[:, 0] - 0.086 * batch.qpos[:, 1]
    for spread, resistance in ((batch.qpos[:, 1], 8160), (slip, 40200)):
        kT = (spread**2).mean() * resistance / (2 * time)
        assert kT == pytest.approx(4.11, rel=0.32)  # 4.5 standard errors of 7 %: -1.4, 0.4


@BRIEF
@pytest.mark.parametrize(
    ("name", "few", "numerics"),
    [
        ("thermal_chain", {"FRAMES": 3, "REPLICAS": 4, "IN_MOVIE": 3}, {"duration": 1.0}),
        ("magnetic_beads", {"RECORDS": 1, "SETTLED": 0}, {"duration": 0.01, "replicas": 2}),
        (
            "magnetic_assembly",
            {"RECORDS": 4, "SHOWN": [0, 1, 2, 3], "LATE": 0},
            {"duration": 0.1, "replicas": 1},
        ),
        ("pick_and_place", {"FRAME_RATE": 0.2}, {}),
        ("magnetic_gripper", {"FRAME_RATE": 0.5, "FRACTIONS": (0.98,)}, {}),
        ("climbing_robot", {"FRAME_RATE": 0.5, "DURATION": 0.3}, {}),
        ("levitation", {"EVERY": 200}, {"duration": 1.6}),
        ("micro_swimmer", {"FRAMES": 3}, {"duration": 1.0, "replicas": 2}),
    ],
)
def test_pictures_and_movies_are_written(
    opengl, example, monkeypatch, tmp_path, capsys, name, few, numerics
):
    module = example(name)
    for constant, value in few.items():
        monkeypatch.setattr(module, constant, value)
    out, movie = tmp_path / "new" / "picture.png", tmp_path / "other" / "movie.mp4"
    module.main(out=out, movie=movie, **numerics)
    assert capsys.readouterr().out.endswith(f"wrote {out}\nwrote {movie}\n")
    assert len(colors(out)) > 1000  # 15577, 7605, 3144, 4954
    assert movie.stat().st_size > 5000  # 21320, 31540, 14549, 14952


def test_the_picture_has_a_color_per_magnet_and_black_without_one(example):
    module = example("magnetic_pendulum")
    ends = module.Ends(np.array([0, 1, 2, -1]), np.array([1.0, 1.0, 1.0, np.nan]))
    *found, black = module.picture(ends, 2).reshape(4, 3)
    for color, own in zip(found, module.COLORS, strict=True):
        np.testing.assert_allclose(color / color.max(), own / own.max(), rtol=3e-15)  # 1e-16
    assert len({tuple(color) for color in found}) == 3
    assert not black.any()


def test_a_name_without_a_suffix_becomes_a_png(example, tmp_path, capsys):
    (tmp_path / "so").mkdir()
    example("support").save(Figure(), tmp_path / "so")
    assert capsys.readouterr().out == f"wrote {tmp_path / 'so.png'}\n"
    assert len(colors(tmp_path / "so.png")) == 1


@pytest.mark.parametrize(
    ("name", "flags", "line"),
    [
        ("magnetic_pendulum", ("--pixels", "1"), "pixels = 1: must be between 2 and 10000"),
        ("magnetic_pendulum", ("--extent", "nan"), "extent = nan: must be between 0.01 and 0.6"),
        ("thermal_chain", ("--duration", "0.5"), "duration = 0.5: must be between 1 and 3600 s"),
        ("magnetic_beads", ("--replicas", "1"), "replicas = 1: must be between 2 and 10000"),
        ("magnetic_assembly", ("--replicas", "0"), "replicas = 0: must be between 1 and 1000"),
        ("levitation", ("--duration", "1"), "duration = 1.0: must be between 1.6 and 60 s"),
        ("micro_swimmer", ("--replicas", "1"), "replicas = 1: must be between 2 and 10000"),
        ("compass_needles", ("--duration", "1"), "duration = 1.0: must be between 2 and 3600 s"),
        (
            "someone_elses_model",
            ("--duration", "inf"),
            "duration = inf: must be between 1 and 3600 s",
        ),
    ],
)
def test_a_mistake_is_one_line_and_code_2(example, monkeypatch, capsys, name, flags, line):
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *flags])
    with pytest.raises(SystemExit) as stop:
        example("support").run(example(name).main)
    assert stop.value.code == 2
    assert capsys.readouterr().err == f"{name}.py: {line}\n"


def test_ctrl_c_is_one_line_and_nothing_is_left(example, monkeypatch, capsys, tmp_path):
    module = example("magnetic_pendulum")

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(module.Batch, "step", interrupted)
    monkeypatch.setattr(sys, "argv", ["magnetic_pendulum.py", "--out", str(tmp_path / "out.png")])
    with pytest.raises(SystemExit) as stop:
        example("support").run(module.main)
    assert stop.value.code == 130
    assert capsys.readouterr().err == "magnetic_pendulum.py: interrupted, nothing written\n"
    assert not any(tmp_path.iterdir())
    assert mujoco.get_mjcb_control() is None


def test_the_quotes_of_the_page_are_in_the_examples():
    paths = [path for path in EXAMPLES.iterdir() if path.is_file()]
    paths.append(ROOT / "models" / "levitation.xml")
    files = [path.read_text(encoding="utf-8") for path in paths]
    quoted = re.findall(r"<!-- from examples -->\n```\w+\n(.*?)```", PAGE, re.DOTALL)
    assert len(quoted) == 22
    for excerpt in quoted:
        lines = [line.strip() for line in excerpt.splitlines()]
        assert any("\n".join(lines) in "\n".join(map(str.strip, f.splitlines())) for f in files)


def test_the_ten_lines_of_the_page_run():
    (lines,) = re.findall(r"<!-- runs -->\n```python\n(.*?)```", PAGE, re.DOTALL)
    namespace: dict = {}
    exec(lines, namespace)
    data = namespace["data"]
    assert data.qpos[0] == pytest.approx(np.pi / 2, rel=5e-8, abs=0)  # 2e-9
