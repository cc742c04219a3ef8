"""The viscous slip law and dry friction, realized by contacts."""

import mujoco
import numpy as np
import pytest
from dm_control.mjcf import from_xml_string
from refusals import refused

import magmotor as mm
from magmotor.devices.ball.coordinates import BallCoordinates
from magmotor.devices.top.states import start


def contact_force(scene, velocity, angular_velocity, timestep):
    """Force and torque about its center of friction on the ball, V_Q, and mjData."""
    model = mm.build(scene)
    model.opt.timestep = timestep
    data = mujoco.MjData(model)
    state = start(scene)._replace(
        velocity=np.array([velocity]), angular_velocity=np.array([angular_velocity])
    )
    coordinates = BallCoordinates(scene.surface, scene.ball_radius)
    data.qpos[:], data.qvel[:] = coordinates.joints(state)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    slip = mm.observables.slip_velocity(scene, state.velocity[0], state.angular_velocity[0])
    turn = data.xmat[model.body("ball").id].reshape(3, 3)
    torque = turn @ data.qfrc_constraint[coordinates.linear :]
    return data.qfrc_constraint[:2], torque, slip, data


SLIPS = [
    ((0.05, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ((1e-6, 2e-6, 0.0), (0.0, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (3.0, -2.0, 7.0)),
    ((2.0, -1.0, 0.0), (100.0, 50.0, -300.0)),
    ((0.05, -0.03, 0.0), (0.0, 0.0, 50.0)),
]


@pytest.mark.parametrize("timestep", [1e-4, 0.025])
@pytest.mark.parametrize("load", [0.3, 9.81, 200.0])
@pytest.mark.parametrize(("velocity", "spin"), SLIPS)
@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_force_over_slip_velocity_is_minus_c(surface, velocity, spin, load, timestep):
    scene = mm.Top(surface=surface, gravity=load, friction=0.3, coupling=1e-20)
    force, torque, slip, _ = contact_force(scene, velocity, spin, timestep)
    law = -scene.friction * slip
    bound = 5e-15  # planar 4.6e-16, plane 6.9e-16
    assert np.abs(force - law[:2]).max() <= bound * np.abs(law).max()
    arm = np.array([0.0, 0.0, -scene.ball_radius])
    expected = np.cross(arm, law)
    assert np.abs(torque - expected).max() <= bound * np.abs(expected).max()


@pytest.mark.parametrize(("surface", "ratio"), [("planar", 5.25e-14), ("plane", 3.5e-6)])
def test_other_forces_are_reduced_by_a_known_part(surface, ratio):
    """That part of the force that would stop the slip is A/R."""
    scene = mm.Top(surface=surface, axis=(0.3, -0.2, 0.8))
    force, *_, data = contact_force(scene, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.01)
    pull, torque = data.xfrc_applied[data.body("ball").id].reshape(2, 3)
    arm = np.array([0.0, 0.0, -scene.ball_radius])
    mass, inertia = scene.ball_mass, 0.4 * scene.ball_mass * scene.ball_radius**2
    slip = pull / mass + np.cross(torque, arm) / inertia
    stopping = -slip / (1 / mass + scene.ball_radius**2 / inertia)
    np.testing.assert_allclose(force, ratio * stopping[:2], rtol=1e-3)  # 1.0e-4


def test_the_slowest_slips_are_damped_too():
    """The solver's tolerance must not suppress their friction."""
    scene = mm.Top(coupling=1e-20)  # nothing else accelerates the ball
    force, _, slip, _ = contact_force(scene, (1e-9, 2e-9, 0.0), (0.0, 0.0, 0.0), 0.0125)
    law = -scene.friction * slip[:2]
    assert np.abs(force - law).max() <= 5e-15 * np.abs(law).max()  # measured: 2e-16


@pytest.mark.parametrize("friction", [1e-3, 0.3, 20.0])
def test_any_friction_coefficient_is_calibrated(friction):
    scene = mm.Top(friction=friction, ball_mass=0.5, ball_radius=0.03, coupling=1e-20)
    force, _, slip, _ = contact_force(scene, (0.05, 0.02, 0), (1, 2, 3), 0.01)
    np.testing.assert_allclose(force, -friction * slip[:2], rtol=5e-14)  # 3.7e-15


def test_without_friction_there_is_no_contact_force():
    for surface in ("planar", "plane"):
        scene = mm.Top(surface=surface, friction=0.0)
        force, torque, *_ = contact_force(scene, (0.05, 0.02, 0), (1, 2, 3), 0.01)
        assert np.abs(force).max() == 0
        assert np.abs(torque).max() == 0


def test_a_ball_on_the_plane_rests_at_its_radius():
    """Calibration compensates for the sinking of a soft contact."""
    scene = mm.Top(surface="plane", coupling=1e-12)
    for timestep in (0.001, 0.025):
        run = mm.simulate(scene, method="mujoco/euler", timestep=timestep, duration=5)
        assert np.abs(run.position[:, 2] - scene.ball_radius).max() < 1e-14  # 6e-16


def test_the_plane_model_follows_the_planar_one():
    """Only the magnetic lift, up to 5 % of the weight, moves the ball: by 1.1e-7 m."""
    planar, plane = (
        mm.simulate(mm.Top(surface=s), method="mujoco/rk4", timestep=0.0125, duration=60)
        for s in ("planar", "plane")
    )
    largest = np.abs(planar.momentum_map).max()
    assert np.abs(plane.momentum_map - planar.momentum_map).max() < 2e-5 * largest  # 4.5e-6
    assert np.abs(plane.position - planar.position).max() < 1e-5  # 3.5e-6 m
    assert np.abs(plane.position[:, 2] - 0.018).max() < 2e-7  # 1.1e-7


def test_a_ball_pulled_up_leaves_the_plane():
    scene = mm.Top.si(surface="plane", position=(0.27, 0.0))
    with pytest.raises(mm.SimulationDiverged) as caught:
        mm.simulate(scene, method="mujoco/rk4", timestep=0.001, duration=5)
    assert caught.value.dataset.position[:, 2].max() > 0.05


G = 9.81
LEVEL = {"surface": "plane", "coupling": 1e-14, "tilt": 0.0}


def rates(initial, duration=0.5, **fields):
    """Mean accelerations, linear along x and angular about y and z."""
    scene = mm.Top(**LEVEL, **fields)
    run = mm.simulate(
        scene, method="mujoco/euler", timestep=0.001, duration=duration, initial=initial
    )
    columns = (run.velocity[:, 0], run.angular_velocity[:, 1], run.angular_velocity[:, 2])
    return [np.polyfit(run.time, column, 1)[0] for column in columns]


def test_coulomb_friction_decelerates_a_sliding_ball():
    along, about_y, _ = rates({"velocity": (0.4, 0.0)}, friction=0.0, coulomb_friction=0.02)
    assert along == pytest.approx(-0.02 * G, rel=0.002)  # measured: +1e-4
    assert about_y == pytest.approx(0.02 * 0.2 * G * 0.018 / 2.592e-5, rel=0.01)  # measured: 5e-4


def test_torsional_friction_decelerates_a_spinning_ball():
    *_, about_z = rates(
        {"angular_velocity": (0, 0, 20.0)},
        friction=0.0,
        coulomb_friction=0.02,
        torsional_friction=2e-5,
    )
    assert about_z == pytest.approx(-2e-5 * 0.2 * G / 2.592e-5, rel=0.005)  # measured: +2e-4


def test_rolling_friction_decelerates_a_rolling_ball():
    along, *_ = rates(
        {"velocity": (0.1, 0.0), "angular_velocity": (0, 0.1 / 0.018, 0)},
        duration=1.0,
        friction=0.3,
        coulomb_friction=0.3,
        torsional_friction=1e-5,
        rolling_friction=2e-5,
    )
    effective_mass = 0.2 + 2.592e-5 / 0.018**2
    # Measured: -4.2 %; while Coulomb friction is not saturated, part of the torque makes slip.
    assert along == pytest.approx(-2e-5 * 0.2 * G / 0.018 / effective_mass, rel=0.06)


def test_the_viscous_law_holds_beside_dry_friction():
    along, *_ = rates({"velocity": (0.1, 0.0)}, duration=0.002, coulomb_friction=1e-5)
    assert along == pytest.approx(-0.3 * 0.1 / 0.2, rel=0.02)  # measured: -0.2 %, the step's


@pytest.mark.parametrize("gravity", [0.3, 9.81])
def test_beside_dry_friction_the_viscous_contact_bears_no_load(gravity):
    """But for 4e-5 m/s^2 times the mass; any load on it is missing from the dry friction."""
    scene = mm.Top(surface="plane", coulomb_friction=0.003, gravity=gravity, coupling=1e-20)
    model = mm.build(scene)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_step(model, data, nstep=4000)
    mujoco.mj_forward(model, data)
    forces = {}
    for number in range(data.ncon):
        force = np.zeros(6)
        mujoco.mj_contactForce(model, data, number, force)
        forces[data.contact[number].friction[0]] = force[0]
    assert len(forces) == 2
    assert 0 < forces[1e6] < 1e-4 * scene.ball_mass  # 4.0e-5
    assert forces[0.003] + forces[1e6] == pytest.approx(scene.weight, rel=3e-11)  # 1e-12


FLOOR = """
<mujoco>
  <option cone="elliptic" impratio="1e-14" timestep="0.005" integrator="RK4"/>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1"/>
    <body name="ball" pos="0 0 0.03">
      <freejoint/>
      <geom name="ball" size="0.03" density="2500"/>
    </body>
  </worldbody>
</mujoco>
"""
MASS = 2500 * 4 / 3 * np.pi * 0.03**3
GIVEN = '<inertial pos="0 0 0" mass="0.5" diaginertia="3e-4 3e-4 3e-4"/>'


def model_of(*contacts, xml=FLOOR, calibrate=True, **fields):
    spec = mujoco.MjSpec.from_string(xml)
    for contact in contacts:
        contact.add_to(spec)
    model = spec.compile()
    for name, value in fields.items():
        getattr(model.opt, name)[:] = value
    for contact in contacts if calibrate else ():
        contact.calibrate(model)
    return model


def slips(model, velocity, steps=400):
    """Times, velocity and slip along x of balls that initially slide without rotating."""
    data = mujoco.MjData(model)
    data.qvel.reshape(-1, 6)[:, 0] = velocity
    rows = []
    for _ in range(steps):
        mujoco.mj_step(model, data)
        speed = data.qvel.reshape(-1, 6)
        radius = model.geom_size[model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE, 0]
        rows.append((data.time, speed[:, 0].copy(), speed[:, 0] - radius * speed[:, 4]))
    return map(np.array, zip(*rows, strict=True))


def decay_error(model, mass, inertia, radius, c):
    """v and V over the initial 0.3 m/s: dV/dt = -c A V, dv/dt = -c V/m."""
    time, speed, slip = slips(model, 0.3)
    mobility = 1 / mass + radius**2 / inertia
    left = np.exp(-c * mobility * time)[:, np.newaxis]
    lost = (1 - left) / (mass * mobility)
    return max(np.abs(slip / 0.3 - left).max(), np.abs(speed / 0.3 - 1 + lost).max())


SOLID = (FLOOR, MASS, 0.4 * MASS * 0.03**2, 0.03)
SMALL = (FLOOR.replace("0.03", "0.004").replace("2500", "7800"), None, None, 0.004)
small = 7800 * 4 / 3 * np.pi * 0.004**3
BALLS = {
    "solid": SOLID,
    "small and heavy": (SMALL[0], small, 0.4 * small * 0.004**2, 0.004),
    "inertial given": (FLOOR.replace("<freejoint/>", GIVEN + "<freejoint/>"), 0.5, 3e-4, 0.03),
}


@pytest.mark.parametrize("name", BALLS)
@pytest.mark.parametrize("rate", [0.5, 5.0])
def test_slip_in_users_models_follows_the_closed_form(name, rate):
    xml, mass, inertia, radius = BALLS[name]
    c = rate / (1 / mass + radius**2 / inertia)
    contact = mm.ViscousContact(c, "ball", "floor")
    model = model_of(contact, xml=xml)
    # 8e-11, 4.5e-9: the step's
    assert decay_error(model, mass, inertia, radius, c) < (1e-9 if rate < 1 else 5e-8)
    assert contact.damping_of(model) == pytest.approx(c, rel=1e-15, abs=0)  # 0


@pytest.mark.parametrize("b", [None, "c"])
def test_a_contact_that_is_not_calibrated_fails_this(b):
    _, mass, inertia, radius = SOLID
    contact = mm.ViscousContact(0.2, "ball", "floor")
    model = model_of(contact, calibrate=False)
    if b == "c":
        model.pair_solreffriction[0, 1] = -0.2
    assert decay_error(model, mass, inertia, radius, 0.2) > 0.5
    assert contact.damping_of(model) < 3e-10  # 2.8e-11


def test_a_ball_ends_rolling_at_five_sevenths():
    model = model_of(mm.ViscousContact(0.5, "ball", "floor"))
    _, speed, slip = slips(model, 0.7, steps=1500)
    assert abs(slip[-1]) < 1e-16  # 0
    assert speed[-1] == pytest.approx(0.5, rel=2e-14, abs=0)  # 1.6e-15


@pytest.mark.parametrize("tilted", ["gravity", "plane"])
def test_a_ball_slips_down_a_tilted_plane_by_the_closed_form(tilted):
    """dV/dt = g sin a - c A V from rest; the ball stays at its radius above the plane."""
    angle, c, rate = 0.3, 0.2, 0.2 * 3.5 / MASS
    along, normal = np.array([np.cos(angle), 0, -np.sin(angle)]), [np.sin(angle), 0, np.cos(angle)]
    spec = mujoco.MjSpec.from_string(FLOOR)
    if tilted == "plane":
        spec.geom("floor").quat = np.array([np.cos(angle / 2), 0, np.sin(angle / 2), 0])
        spec.body("ball").pos = 0.03 * np.array(normal)
    else:
        spec.option.gravity = 9.81 * np.array([np.sin(angle), 0, -np.cos(angle)])
        along, normal = np.array([1, 0, 0]), [0, 0, 1]
    contact = mm.ViscousContact(c, "ball", "floor")
    contact.add_to(spec)
    model = spec.compile()
    contact.calibrate(model)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=200)
    slip = data.qvel[:3] @ along - 0.03 * data.qvel[4]
    law = 9.81 * np.sin(angle) / rate * (1 - np.exp(-rate * data.time))
    assert slip == pytest.approx(law, rel=3e-8)  # 2.8e-9
    assert abs(data.qpos[:3] @ normal - 0.03) < 2e-15  # 2.5e-16


def test_two_balls_have_their_own_damping():
    big = '<body pos="0 2 0.05"><freejoint/><geom name="big" size="0.05" mass="1"/></body>'
    other = FLOOR.replace("</worldbody>", big + "</worldbody>")
    contacts = (
        mm.ViscousContact(0.2, "ball", "floor"),
        mm.ViscousContact(0.7, "big", "floor", name="viscous of big"),
    )
    model = model_of(*contacts, xml=other)
    time, _, slip = slips(model, (0.3, 0.1))
    rates = np.array([0.2 * 3.5 / MASS, 0.7 * 3.5])
    left = np.exp(-rates * time[:, np.newaxis])
    assert np.abs(slip / (0.3, 0.1) - left).max() < 1e-7  # 9.5e-9: the solver's tolerance
    for contact in contacts:
        assert contact.damping_of(model) == pytest.approx(contact.damping, rel=1e-15, abs=0)  # 0


HELD = FLOOR.replace("1e-14", "1").replace(
    "<freejoint/>",
    '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="ball"/>',
)
HELD_FIRMLY = HELD.replace('impratio="1"', 'impratio="1e-14"')
ROD = FLOOR.replace(
    "<freejoint/>",
    '<joint type="hinge" axis="0 0 1" pos="0 0.4 0"/><joint type="hinge" axis="0 1 0"/>'
    '<geom type="capsule" fromto="0 0 0 0 0.4 0.1" size="0.01" contype="0" conaffinity="0"/>',
)


@pytest.mark.parametrize(("xml", "bound"), [(HELD, 1e-15), (HELD_FIRMLY, 5e-15), (ROD, 5e-15)])
def test_a_contact_that_bears_no_load_has_the_law_on_other_joints(xml, bound):
    """With `impratio` 1, A/R is 3.5e-4; the A of a mechanism is unknown and must not matter."""
    contact = mm.ViscousContact(0.2, "ball", "floor", bears_load=False)
    model = model_of(contact, xml=xml, gravity=0.0)
    data = mujoco.MjData(model)
    data.qvel[:] = 0.3 * np.arange(1, model.nv + 1)
    mujoco.mj_forward(model, data)
    jacobian = np.empty((3, model.nv))
    (touching,) = data.contact
    mujoco.mj_jac(model, data, jacobian, None, touching.pos, model.body("ball").id)
    force = np.empty(6)
    mujoco.mj_contactForce(model, data, 0, force)
    along = touching.frame.reshape(3, 3).T @ force[:3]
    slip = jacobian @ data.qvel
    # 0, 2e-16, 2e-16
    assert np.abs(along + 0.2 * slip)[:2].max() < bound * np.abs(0.2 * slip).max()


def test_a_description_is_completed_and_its_xml_has_the_numbers():
    contact = mm.ViscousContact(0.2, "ball", "floor")
    spec, tree = mujoco.MjSpec.from_string(FLOOR), from_xml_string(FLOOR)
    calibrated = model_of(contact)
    for description in (spec, tree):
        contact.add_to(description)
        contact.complete(description)
    from_tree = mujoco.MjModel.from_xml_string(tree.to_xml_string())
    for model in (spec.compile(), from_tree):
        for name in ("pair_solreffriction", "pair_margin", "pair_friction", "pair_solimp"):
            np.testing.assert_array_equal(getattr(model, name), getattr(calibrated, name))
    from_spec = mujoco.MjModel.from_xml_string(spec.to_xml())
    assert contact.damping_of(from_spec) == pytest.approx(0.2, rel=5e-6)  # 4e-7: six digits


def test_the_damping_of_a_model_shows_changes_after_the_calibration():
    contact = mm.ViscousContact(0.2, "ball", "floor", bears_load=False)
    model = model_of(contact, xml=HELD)
    model.pair_solreffriction *= 2
    assert contact.damping_of(model) == pytest.approx(0.4, rel=1e-15, abs=0)  # 0
    model.opt.impratio = 0.1
    assert contact.damping_of(model) == pytest.approx(0.04, rel=1e-3)  # 4.7e-4, the A in A + R
    contact.calibrate(model)
    assert contact.damping_of(model) == pytest.approx(0.2, rel=1e-15, abs=0)  # 0


ROD, OBLATE = "1e-8 3e-5 3e-5", "3e-6 1.6e-5 1.6e-5"
OFF_CENTER = 'pos="0 0.01 0.005" mass="0.1" diaginertia="3e-5 3e-5 3e-5"'


@pytest.mark.parametrize(
    ("inertial", "impratio", "is_right"),
    [
        (f'pos="0 0 0" mass="0.1" diaginertia="{ROD}"', "1e-14", True),
        (f'pos="0 0 0" mass="0.1" diaginertia="{ROD}"', "1e-9", False),
        (f'pos="0 0 0" mass="0.1" diaginertia="{OBLATE}"', "1e-9", True),
        (f'pos="0 0 0" mass="0.1" diaginertia="{OBLATE}"', "1e-7", False),
        (OFF_CENTER, "1e-9", True),
        (OFF_CENTER, "1e-6", False),
    ],
)
def test_damping_is_right_in_every_direction_or_rejected(inertial, impratio, is_right):
    """From the change of the force along x and y; the error is at most A/R, here 0.5 %."""
    contact = mm.ViscousContact(0.2, "ball", "floor")
    geom = '<geom name="ball" size="0.03" density="2500"/>'
    xml = FLOOR.replace(geom, f"<inertial {inertial}/>{geom}").replace("1e-14", impratio)
    model = model_of(contact, xml=xml, calibrate=False)
    if not is_right:
        with refused("option impratio"):
            contact.calibrate(model)
        return
    contact.calibrate(model)
    data = mujoco.MjData(model)
    for i in range(2):
        forces = []
        for speed in (0.0, 1e-3):
            data.qvel[:] = speed * np.eye(model.nv)[i]
            mujoco.mj_forward(model, data)
            forces.append(data.qfrc_constraint[i])
        found = (forces[0] - forces[1]) / 1e-3
        assert found == pytest.approx(0.2, rel=0.005, abs=0)  # 2.4e-4
