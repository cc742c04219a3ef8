"""`mm.Langevin` piece by piece: friction, noise, forces, heat and work, bits, and each refusal.

What becomes of its Boltzmann ensembles is tested in test_langevin_boltzmann.py. Statistical tests
have fixed seeds.
"""

import copy
import itertools
from typing import Any

import mujoco
import numpy as np
import pytest
from test_friction import TREE

import magmotor as mm
from magmotor import noise
from magmotor.mjcf.langevin import thermostat
from magmotor.mjcf.langevin.friction import friction_matrix

EVERY_DAMPER = TREE.replace('biasprm="1 0 -0.2"', 'biasprm="0 0 -0.2"').replace(
    "<option", '<option timestep="1e-7"'
)
"""Actuators on sites must not have a bias of the position, which has no potential."""

CONTACT = ("contact",)


def state(model: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """Return data with random positions and velocities."""
    rng, data = np.random.default_rng(seed), mujoco.MjData(model)
    mujoco.mj_integratePos(model, data.qpos, rng.normal(size=model.nv), 1.0)
    data.qvel[:] = rng.normal(size=model.nv)
    return data


def at(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjData:
    """Return other data at the same position, computed by MuJoCo itself, at rest."""
    other = mujoco.MjData(model)
    other.qpos[:] = data.qpos
    mujoco.mj_forward(model, other)
    return other


def inertia(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    matrix = np.empty((model.nv, model.nv))
    for row, unit in zip(matrix, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    return matrix


@pytest.mark.parametrize("seed", range(4))
def test_friction_removes_the_power_of_every_damper(seed):
    """The heat of one short step without noise is -h v C v, by a numpy sum over Jacobians."""
    model = mujoco.MjModel.from_xml_string(EVERY_DAMPER)
    data = state(model, seed)
    velocity = data.qvel.copy()
    power = velocity @ friction_matrix(model, at(model, data)) @ velocity
    heat = mm.Langevin(model, kT=0, disable=CONTACT).step(data)["kT"]
    assert heat / 1e-7 == pytest.approx(-power, rel=1e-3)  # measured: 6.6e-5, of order h


def test_noise_has_the_covariance_of_the_friction():
    """The impulse of one short step from rest has the covariance 2 kT h C; 40 000 replicas.

    All elements are within 4.5 standard errors; false alarm rate 1e-3 for the 171 elements.
    """
    model = mujoco.MjModel.from_xml_string(EVERY_DAMPER)
    data = state(model, 5)
    whole = at(model, data)
    replicas = 40_000
    start = np.tile(np.concatenate([[0.0], data.qpos, 0 * data.qvel]), (replicas, 1))
    langevin = mm.Langevin(model, kT=1.0, disable=CONTACT, seed=3)
    threads = [mujoco.MjData(model) for _ in range(2)]
    ends = langevin.rollout(threads, start, None, control_spec=0, nstep=1)[:, 0, model.nq :]
    impulses = (ends - ends.mean(axis=0)) @ inertia(model, whole)
    covariance = impulses.T @ impulses / replicas / 2e-7
    expected = friction_matrix(model, whole)
    squares = np.diag(expected)
    errors = np.sqrt((expected**2 + np.outer(squares, squares)) / replicas)
    assert (abs(covariance - expected) / errors).max() < 4.5  # 2.3
    assert (abs(0.95 * covariance - expected) / errors).max() > 6  # 5 % would be seen


def heat_by_bath(model: mujoco.MjModel, kT: dict[str, float], data: mujoco.MjData) -> dict:
    return mm.Langevin(model, kT=kT, disable=CONTACT, seed=1).step(copy.copy(data))


def test_every_damper_exchanges_heat_with_its_own_bath():
    """The baths' heats add up to that of one bath; one bath's is the power of its own dampers."""
    model = mujoco.MjModel.from_xml_string(EVERY_DAMPER)
    data = state(model, 7)
    names = [model.body(i).name for i in range(1, model.nbody) if model.body(i).name]
    names += [model.tendon(i).name for i in range(model.ntendon)]
    names += [f"site {i}" for i in range(2)]
    spec = mujoco.MjSpec.from_string(EVERY_DAMPER)
    for i, actuator in enumerate([a for a in spec.actuators if a.trntype == 4]):
        actuator.name = f"site {i}"
    for i, actuator in enumerate([a for a in spec.actuators if a.trntype == 2]):
        actuator.name = f"crank {i}"
        names.append(f"crank {i}")
    model = spec.compile()
    data = state(model, 7)
    split = mm.Langevin(model, kT=dict.fromkeys(names, 0.2), disable=CONTACT).step(copy.copy(data))
    whole = mm.Langevin(model, kT=0.2, disable=CONTACT).step(copy.copy(data))
    assert sum(split[name] for name in names) == pytest.approx(whole["kT"], rel=1e-9)  # 1e-12
    cold = mm.Langevin(model, kT=dict.fromkeys(names, 0.0), disable=CONTACT).step(copy.copy(data))
    velocity, reference = data.qvel, at(model, data)
    jacobian = np.empty((6, model.nv))
    mujoco.mj_jacBodyCom(model, reference, jacobian[:3], jacobian[3:], model.body("other").id)
    pivot = model.joint("pivot").dofadr[0]
    total = model.dof_damping[pivot] * velocity[pivot] ** 2
    assert cold["other"] < -total * 1e-7  # and the drag of the fluid


@pytest.mark.parametrize("seed", range(3))
def test_forces_are_those_of_mujoco_at_rest(seed):
    """Gravity, its compensation, springs of joints and tendons, actuators, applied forces."""
    xml = EVERY_DAMPER.replace('name="hip"', 'name="hip" stiffness="3" springref="20"')
    xml = xml.replace('name="ball"', 'name="ball" stiffness="2"')
    xml = xml.replace('name="spatial"', 'name="spatial" stiffness="5" springlength="0.3"')
    model = mujoco.MjModel.from_xml_string(xml.replace('name="arm"', 'name="arm" gravcomp="0.7"'))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data = state(model, seed)
    data.ctrl[:] = 0.3
    data.qfrc_applied[:] = np.linspace(-1, 1, model.nv)
    data.xfrc_applied[1:] = np.linspace(-2, 1, 6 * (model.nbody - 1)).reshape(-1, 6)
    found = mm.Langevin(model, kT=1).forces(data)
    data.qvel[:] = 0
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(found, data.qfrc_smooth, rtol=0, atol=1e-12)  # 2e-14 of 70


ARM = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" type="ball" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.1 0 -0.5" size="0.05" mass="1" contype="0"
            conaffinity="0"/>
      <body name="lower" pos="0.1 0 -0.5">
        <joint name="elbow" axis="0 1 0" damping="0.1" {elbow}/>
        <geom name="forearm" type="capsule" fromto="0 0 0 0 0 -0.5" size="0.05" mass="1"
              condim="1"/>
      </body>
    </body>
    <body name="slider" pos="1 0 -0.9">
      <joint name="slide" type="slide" axis="1 0 0" damping="0.1"/>
      <geom name="block" type="sphere" size="0.1" mass="0.5" condim="1"/>
    </body>
  </worldbody>
  {more}
</mujoco>
"""
SOFT = {
    "limit": ARM.format(elbow='range="-30 40"', more=""),
    "contact": ARM.format(elbow="", more=""),
    "tendon limit": ARM.format(
        elbow="",
        more='<tendon><fixed limited="true" range="-0.2 0.3"><joint joint="elbow" coef="1"/>'
        '<joint joint="slide" coef="2"/></fixed></tendon>',
    ),
    "connect": ARM.format(
        elbow="",
        more='<equality><connect body1="lower" body2="slider" anchor="0 0 -0.5"/></equality>',
    ),
    "weld": ARM.format(
        elbow="", more='<equality><weld body1="lower" body2="slider"/></equality>'
    ),
    "joint": ARM.format(
        elbow="",
        more='<equality><joint joint1="elbow" joint2="slide" polycoef="0 1 0.5 0 0"/></equality>',
    ),
}  # fmt: skip


def work_on_a_loop(model, langevin: mm.Langevin, base, seed: int) -> tuple[float, float]:
    """Return the work of the forces on a closed path, and the sum of its absolute values."""
    rng, pieces = np.random.default_rng(seed), 1600
    cosine, sine, center = rng.normal(size=(3, model.nv)) * [[0.7], [0.7], [0.2]]
    data, works = mujoco.MjData(model), []
    for angle in 2 * np.pi * (np.arange(pieces) + 0.5) / pieces:
        ends = []
        for turn in (-np.pi / pieces, np.pi / pieces, 0.0):
            end, t = base.copy(), angle + turn
            mujoco.mj_integratePos(model, end, cosine * np.cos(t) + sine * np.sin(t) + center, 1.0)
            ends.append(end)
        step = np.empty(model.nv)
        mujoco.mj_differentiatePos(model, step, 1.0, ends[0], ends[1])
        data.qpos[:] = ends[2]
        works.append(langevin.forces(data) @ step)
    return sum(works), sum(map(abs, works))


@pytest.mark.parametrize("kind", SOFT)
def test_soft_constraints_have_a_potential(kind):
    """Their forces do no work on closed paths, up to the quadrature at their kinks."""
    model = mujoco.MjModel.from_xml_string(SOFT[kind])
    langevin = mm.Langevin(model, kT=1, disable=() if kind == "contact" else CONTACT)
    free = mm.Langevin(model, kT=1, disable=("constraint",))
    data = mujoco.MjData(model)
    data.qpos[model.joint("slide").qposadr[0]] = -0.8
    data.qpos[model.joint("elbow").qposadr[0]] = 0.0 if kind == "contact" else 1.0
    base = data.qpos.copy()
    assert abs(langevin.forces(data) - free.forces(data)).max() > 1
    for seed in range(2):
        work, size = work_on_a_loop(model, langevin, base, seed)
        assert abs(work) < 3e-5 * size  # measured: 3.3e-6


@pytest.mark.parametrize(
    ("kind", "joint", "push"), [("limit", "elbow", 20.0), ("tendon limit", "slide", 3.0)]
)
def test_soft_constraints_give_way_as_in_mujoco(kind, joint, push):
    """A constant force at rest: MuJoCo's solver and the forces of the position agree."""
    model = mujoco.MjModel.from_xml_string(SOFT[kind])
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.dof_damping[:] = 5
    data = mujoco.MjData(model)
    dof = model.joint(joint).dofadr[0]
    data.qfrc_applied[dof] = push
    model.opt.timestep = 0.002
    mujoco.mj_step(model, data, nstep=50_000)
    assert abs(data.qvel).max() < 1e-6
    assert abs(data.qfrc_constraint[dof]) > 2
    found = mm.Langevin(model, kT=0).forces(data)
    np.testing.assert_allclose(found, 0, atol=1e-4)


@pytest.mark.parametrize("splitting", ["baoab", "obabo", "middle", "verlet", "o-rk4-o", "o-step-o"])
def test_heat_and_work_add_up_to_the_kinetic_energy(splitting):
    model = mujoco.MjModel.from_xml_string(SOFT["limit"])
    langevin = mm.Langevin(model, kT=0.5, splitting=splitting, disable=CONTACT)
    data = state(model, 2)

    def energy():
        return data.qvel @ inertia(model, at(model, data)) @ data.qvel / 2

    before = energy()
    exchanged = langevin.step(data, 2000)
    change = energy() - before
    bound = 1e-9 if splitting != "o-rk4-o" else 0.2  # the rule's own error of the energy
    assert abs(change) > 0.1
    assert exchanged["kT"] + exchanged["work"] == pytest.approx(change, abs=bound)


def end(data: mujoco.MjData) -> np.ndarray:
    return np.concatenate([[data.time], data.qpos, data.qvel])


@pytest.mark.parametrize("splitting", ["baoab", "obabo", "o-step-o"])
def test_neither_calls_nor_threads_nor_records_change_a_bit(splitting, monkeypatch):
    model = mujoco.MjModel.from_xml_string(SOFT["connect"])
    langevin = mm.Langevin(model, kT=0.5, splitting=splitting, disable=CONTACT, seed=4)
    whole = mujoco.MjData(model)
    langevin.step(whole, 300)
    for pieces in ((1, 2, 297), (100, 200)):
        data = mujoco.MjData(model)
        for steps in pieces:
            langevin.step(data, steps)
        np.testing.assert_array_equal(end(data), end(whole))
    runs = [
        langevin.sample(nstep=300, replicas=3, every=every, settle=settle)
        for every, settle in ((1, 0), (10, 0), (7, 0))
    ]
    np.testing.assert_array_equal(runs[0].qpos[0, -1], whole.qpos)
    np.testing.assert_array_equal(runs[1].qpos, runs[0].qpos[:, 9::10])
    np.testing.assert_array_equal(runs[2].qvel, runs[0].qvel[:, 6::7])
    settled = langevin.sample(nstep=200, replicas=3, settle=100)
    np.testing.assert_array_equal(settled.qpos, runs[0].qpos[:, 100:])
    start = np.tile(np.concatenate([[0.0], model.qpos0, np.zeros(model.nv)]), (3, 1))
    for threads in (1, 2):
        used = [mujoco.MjData(model) for _ in range(threads)]
        paths = langevin.rollout(used, start, None, control_spec=0, nstep=300)
        np.testing.assert_array_equal(paths[..., : model.nq], runs[0].qpos)
    monkeypatch.setattr(thermostat, "FIRST_STEPS", 1)
    monkeypatch.setattr(thermostat, "SECONDS_BETWEEN_CHECKS", 0.0)
    data = mujoco.MjData(model)
    langevin.step(data, 300)
    np.testing.assert_array_equal(end(data), end(whole))
    for one, other in itertools.combinations(runs[0].qpos[:, -1].values, 2):
        assert abs(one - other).max() > 1e-3


def test_records_add_up_heat_and_work():
    model = mujoco.MjModel.from_xml_string(SOFT["limit"])
    langevin = mm.Langevin(model, kT=0.5, disable=CONTACT)
    run = langevin.sample(nstep=400, replicas=2, every=10)
    data = mujoco.MjData(model)
    first, second = langevin.step(data, 150), langevin.step(data, 250)
    for name, sums in (("kT", run.heat[0, :, 0]), ("work", run.work[0])):
        assert float(sums[14]) == pytest.approx(first[name], rel=1e-12)
        assert float(sums[-1]) == pytest.approx(first[name] + second[name], rel=1e-12)


def test_a_slide_follows_the_brownian_path_of_the_package():
    """Without inertia to speak of, its velocity is that of the path: c v = sqrt(2 kT c) dW/dt."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.5" gravity="0 0 0"/><worldbody><body>'
        '<joint type="slide" axis="1 0 0" damping="2"/><geom size="0.1" mass="1"/>'
        "</body></worldbody></mujoco>"
    )
    fine = noise.BrownianPath(6, 0.25)
    for path in (noise.BrownianPath(6, 0.5), fine.coarsened(2)):
        data = mujoco.MjData(model)
        langevin = mm.Langevin(model, kT=0.3, splitting="middle", path=path)
        for rise in path.increments(5):
            velocity = data.qvel[0]
            langevin.step(data)
            # (m + h c/2) v' = (m - h c/2) v + sqrt(2 kT c) dW
            expected = ((1 - 0.5) * velocity + np.sqrt(1.2) * rise) / (1 + 0.5)
            assert data.qvel[0] == pytest.approx(expected, rel=1e-13)


WARM: dict[str, Any] = {"disable": CONTACT}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"kT": -1.0}, r"kT = -1.0: must be at least 0"),
        ({"kT": {}}, r"kT = \{\}: must name at least one joint, tendon, actuator or body"),
        ({"kT": {"knee": 1.0}}, r"kT = 'knee': must be the name of a joint, tendon, actuator"),
        ({"kT": {"upper": 1.0}}, r"kT = \['upper'\]: must have the temperature of joint 'elbow'"),
        ({"kT": {"upper": 1.0, "lower": -2.0}}, r"kT\['lower'\] = -2.0: must be at least 0"),
        ({"kT": 1, "splitting": "baob"}, r"splitting = 'baob': must be"),
        ({"kT": 1, "disable": ("contacts",)}, r"disable = 'contacts': must be"),
        ({"kT": 1, "friction": -1.0}, r"friction = -1.0: must be at least 0"),
        ({"kT": 1, "friction": 0.0}, r"friction = 0.0: must damp something, or else kT is never"),
        (
            {"kT": 1, "friction": [1, 1, 1, -1, 1]},
            r"friction of joint 'elbow' = -1.0: must be zero",
        ),
        ({"kT": 1, "friction": [1, 2]}, r"friction has shape \(2,\)"),
        ({"kT": 1, "friction": np.eye(5) + np.eye(5, k=1)}, r"friction = .* must be symmetric"),
        (
            {"kT": 1, "friction": np.eye(5) + 2 * (np.eye(5, k=1) + np.eye(5, k=-1))},
            r"friction = 'matrix with the eigenvalue -2.46.*': must be positive semidefinite; .*",
        ),
        (
            {"kT": 1, "path": noise.BrownianPath(1, 0.1)},
            r"path.timestep = 0.1: must be the timestep of the model, 0.002",
        ),
        (
            {"kT": {"upper": 1.0, "lower": 1.0, "slider": 2.0}, "friction": 1.0},
            r"kT = .*: must be one temperature, since friction as given belongs to no single joint",
        ),
    ],
)
def test_what_is_wrong_is_named(given, message):
    model = mujoco.MjModel.from_xml_string(SOFT["limit"])
    disable = given.get("disable", (*CONTACT, "limit"))
    with pytest.raises(ValueError, match=f"^{message}"):
        mm.Langevin(model, **given | {"disable": disable})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ('frictionloss="0.1"', r"joint 'elbow': frictionloss = 0.1: .* flag frictionloss"),
        ('damping="0.1 0.2"', r"joint 'elbow': dampingpoly = .*: damping that depends on velocity"),
    ],
)
def test_what_has_no_temperature_is_refused(change, message):
    xml = ARM.format(elbow=change, more="").replace(f'damping="0.1" {change}', change)
    if "damping" not in change:
        xml = ARM.format(elbow=change, more="")
    model = mujoco.MjModel.from_xml_string(xml)
    with pytest.raises(ValueError, match=f"^{message}"):
        mm.Langevin(model, kT=1, disable=CONTACT)


def test_contacts_with_friction_are_refused_and_may_be_disabled():
    model = mujoco.MjModel.from_xml_string(ARM.format(elbow="", more=""))
    model.geom_condim[:] = 3
    with pytest.raises(ValueError, match=r"geom 'forearm' and geom 'block': condim = 3: must be 1"):
        mm.Langevin(model, kT=1)
    mm.Langevin(model, kT=1, disable=CONTACT)
    mm.Langevin(model, kT=1, splitting="o-step-o")


def test_nothing_damped_never_reaches_a_temperature():
    model = mujoco.MjModel.from_xml_string(SOFT["limit"])
    model.dof_damping[:] = 0
    with pytest.raises(ValueError, match="must damp something, or else kT is never reached"):
        mm.Langevin(model, kT=1, disable=CONTACT)
    mm.Langevin(model, kT=1, friction=1.0, disable=CONTACT)


def test_joints_that_move_no_inertia_are_named():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><joint name="empty" damping="1"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="2e-15 2e-15 2e-15"/>'
        "</body></worldbody></mujoco>"
    )
    with pytest.raises(ValueError, match=r"joint 'empty': inertia at qpos0 = 0.0: must be posit"):
        mm.Langevin(model, kT=1)


def test_what_is_stepped_is_what_was_read():
    model = mujoco.MjModel.from_xml_string(SOFT["limit"])
    langevin = mm.Langevin(model, kT=1, disable=CONTACT)
    with pytest.raises(ValueError, match=r"data.model = .* must be the model of this Langevin"):
        langevin.step(mujoco.MjData(mujoco.MjModel.from_xml_string(SOFT["limit"])))
    with pytest.raises(ValueError, match=r"nstep = 1.5: must be an integer"):
        langevin.step(mujoco.MjData(model), 1.5)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match=r"nstep = 100000000000: .* do not fit in memory"):
        langevin.sample(nstep=10**11, replicas=100)
    step = mm.Langevin(model, kT=1, splitting="o-step-o")
    with pytest.raises(ValueError, match="splitting = 'o-step-o': must not consist of steps"):
        step.largest_timestep(mujoco.MjData(model))
    model.opt.timestep = 0.5
    with pytest.raises(ValueError, match=r"timestep = 0.5: must still be 0.002"):
        langevin.step(mujoco.MjData(model))


def test_a_lost_replica_is_reported_with_all_records():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.05"/><worldbody><body>'
        '<joint name="j" type="slide" axis="1 0 0" damping="0.1" stiffness="1650"/>'
        '<geom size="0.1" mass="1"/></body></worldbody></mujoco>'
    )
    langevin = mm.Langevin(model, kT=1)
    assert langevin.largest_timestep(mujoco.MjData(model)) < 0.05
    with pytest.raises(mm.LangevinDiverged, match=r"^replica 0 was lost at t = .*") as caught:
        langevin.sample(nstep=10_000, replicas=3, every=10)
    run = caught.value.dataset
    lost = np.isnan(run.qpos[0, :, 0].values)
    assert run.qpos.shape == (3, 1000, 1)
    assert not lost[0]
    assert lost[-1]
    with pytest.raises(FloatingPointError, match="the state is not finite at t = "):
        langevin.step(mujoco.MjData(model), 10_000)


@pytest.mark.parametrize("solref", ["0.02 1", "-2500 -100"], ids=["standard", "direct"])
def test_constraints_that_are_too_stiff_for_the_timestep_are_softened(solref):
    """At 20 ms the limit would be unstable; it is softened to an oscillation of 0.5 / h."""
    xml = (
        f'<mujoco><option timestep="0.02"/><worldbody><body><joint type="slide" axis="1 0 0"'
        f' range="-0.1 0" damping="0.5" solreflimit="{solref}" solimplimit="0.95 0.95 0.001"/>'
        '<geom size="0.1" mass="1"/></body></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qpos[0] = 0.01
    with pytest.warns(UserWarning, match=r"softened to suit the timestep 0.02: joint limits \(1, "):
        langevin = mm.Langevin(model, kT=0.3)
    stiffness = -langevin.forces(data)[0] / 0.01
    assert stiffness * 0.02**2 == pytest.approx(0.25, rel=1e-6)  # at rest; the mass is 1
    assert langevin.largest_timestep(data) == pytest.approx(0.08, rel=1e-4)  # 2/omega
    run = langevin.sample(100_000, replicas=8, every=5, settle=1000)
    found = mm.observables.kinetic_temperature(model, run)
    truth = mm.observables.metropolis(
        langevin.effective_model, 0.3, samples=4000, replicas=8, every=5
    )
    # 4 standard errors, 1.1 %; the kinetic temperature is that of a velocity, second order in h.
    assert float(found.total) == pytest.approx(0.3, rel=0.04)
    errors = [
        float(one.qpos.mean(["time" if "time" in one.dims else "sample", one.qpos.dims[-1]]).std())
        for one in (run, truth)
    ]
    difference = float(run.qpos.mean() - truth.qpos.mean())
    assert abs(difference) < 4 * np.hypot(errors[0], errors[1]) / np.sqrt(8)
    model.opt.timestep = 0.002
    mm.Langevin(model, kT=0.3)  # without a warning
    model.opt.timestep = 0.02
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    stiff = mm.Langevin(model, kT=0.3)
    assert stiff.largest_timestep(data) < 0.02


def test_the_model_of_the_user_stays_as_it_is():
    model = mujoco.MjModel.from_xml_string(EVERY_DAMPER)
    before = np.concatenate([model.dof_damping, model.actuator_biasprm.ravel(), model.opt.gravity])
    flags, counts = model.opt.disableflags, (model.ngeom, model.nsite, model.nplugin)
    mm.Langevin(model, kT=1, disable=CONTACT).step(mujoco.MjData(model), 5)
    after = np.concatenate([model.dof_damping, model.actuator_biasprm.ravel(), model.opt.gravity])
    np.testing.assert_array_equal(after, before)
    assert flags == model.opt.disableflags
    assert counts == (model.ngeom, model.nsite, model.nplugin)
