"""The viewer: live simulations without a window, and `magmotor view` in a virtual display."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from refusals import refused

import magmotor as mm
from magmotor.commands import view
from magmotor.commands.output import warn_in_one_line
from magmotor.commands.view import report
from magmotor.device import Device, Slider
from magmotor.live import LiveSimulation, Loop, Pace, StateLost, live_scene
from magmotor.live.loop import PIECE
from magmotor.live.panel import Panel
from magmotor.live.readouts import Readouts

METHOD = "mujoco/euler"
STEPS = 300
NEEDLE = """
<mujoco>
  <size nuserdata="1"/>
  <custom><text name="magmotor" data="dipoles noise"/></custom>
  <worldbody>
    <site name="north" pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    <body name="needle" user="0 0 0 0 0 2e-6">
      <joint type="hinge" axis="0 0 1" damping="1e-4"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site name="needle" zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
  <keyframe><key qpos="0.3" time="2"/></keyframe>
</mujoco>
"""


def live(scene, seed=0):
    return live_scene(scene, method=METHOD, timestep=0.01, seed=seed)


def slider(simulation, name):
    """The control of a slider, by its name without the unit."""
    labels = [simulation.model.actuator(i).name for i in range(simulation.model.nu)]
    return simulation.data.actuator(
        next(k for k in labels if k.split(" (")[0].replace(" ", "_") == name)
    )


def put(simulation, **sliders):
    """Move sliders like the viewer."""
    for name, value in sliders.items():
        slider(simulation, name).ctrl = value
    simulation.apply_input()


def whole(simulation):
    return np.concatenate([simulation.data.qpos, simulation.data.qvel])


def simulated(scene, seed=0):
    """Return the position (or x) after the steps by `simulate`."""
    duration = STEPS * 0.01
    run = mm.simulate(scene, method=METHOD, timestep=0.01, duration=duration, seed=seed)
    end = run.isel(time=-1)
    return end.x.values if isinstance(scene, mm.Disk) else end.position.values[:2]


TOP, DISK, MOTOR = mm.Top(), mm.Disk(), mm.Motor(velocity=(0.0, 0.05))
HOT = {"alpha_ball": np.sqrt(2 * 0.3 * 1e-5), "alpha_ring": np.sqrt(2 * 0.1 * 1e-5)}
CASES = {
    "untouched": (TOP, {}, TOP),
    "friction": (TOP, {"friction": 0.5}, mm.Top(friction=0.5)),
    "tilt and height": (
        TOP,
        {"tilt": 0.1, "height": 0.25},
        mm.Top(tilt=0.1, ring_height=0.25),
    ),
    "torsion": (
        mm.Top(torsional_damping=1e-6),
        {"tilt": 0.1},
        mm.Top(torsional_damping=1e-6, tilt=0.1),
    ),
    "plane": (mm.Top(surface="plane"), {"friction": 0.5}, mm.Top(surface="plane", friction=0.5)),
    "from no friction": (mm.Top.paper(2), {"friction": 0.5}, mm.Top.paper(2, friction=0.5)),
    "script": (mm.Top.experiment(), {}, mm.Top.experiment()),
    "disk": (DISK, {}, DISK),
    "disk's friction": (DISK, {"friction": 0.2}, mm.Disk(friction=0.2, noise=np.sqrt(50))),
    "disk's temperature": (DISK, {"temperature": 20}, mm.Disk(noise=2)),
    "from no noise": (mm.Disk(noise=0), {"temperature": 20}, mm.Disk(noise=2)),
    "motor": (
        MOTOR,
        {"friction_ball": 0.3, "friction_ring": 0.1, "temperature": 1e-5},
        MOTOR.replace(friction_ball=0.3, friction_ring=0.1, **HOT),
    ),
    "nonuniform motor": (
        mm.Motor.paper("nonuniform-a"),
        {"alpha_ring": 3e-4},
        mm.Motor.paper("nonuniform-a", alpha_ring=3e-4),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_sliders_make_the_scene_with_their_values(case):
    scene, sliders, said = CASES[case]
    simulation = live(scene, seed=3)
    put(simulation, **sliders)
    simulation.advance(STEPS)
    assert simulation.notice == ""
    expected = np.atleast_1d(simulated(said, seed=3))
    error = np.abs(simulation.data.qpos[: len(expected)] - expected).max()
    assert error < 3e-16  # 0, or 1e-17


@pytest.mark.parametrize("case", ["friction", "tilt and height", "disk's temperature", "motor"])
def test_a_slider_that_is_not_moved_is_another_scene(case):
    scene, _, said = CASES[case]
    change = np.abs(simulated(scene, seed=3) - simulated(said, seed=3)).max()
    assert change > 1e-3  # 8e-3 of the motor


@pytest.mark.parametrize("scene", [TOP, mm.Top.experiment(), DISK, MOTOR], ids=type)
@pytest.mark.parametrize("steps", [0, 50])
def test_the_viewers_reset_restores_the_start_to_the_bit(scene, steps):
    simulation, fresh = live(scene, seed=5), live(scene, seed=5)
    put(simulation, friction_ball=0.3) if scene is MOTOR else put(simulation, friction=0.2)
    simulation.advance(steps)
    mujoco.mj_resetData(simulation.model, simulation.data)  # as the viewer does
    simulation.apply_input()
    np.testing.assert_array_equal(simulation.data.ctrl, fresh.data.ctrl)
    for _ in range(2):
        np.testing.assert_array_equal(whole(simulation), whole(fresh))
        simulation.advance(100)
        fresh.advance(100)


def test_a_slider_out_of_bounds_moves_back_and_says_why():
    simulation = live(TOP)
    put(simulation, height=0.1)
    put(simulation, tilt=0.4)
    assert "tilt = 0.4: must be less than 0.2985 rad, where the ring" in simulation.notice
    assert slider(simulation, "tilt").ctrl == TOP.tilt
    assert slider(simulation, "height").ctrl == 0.1
    put(simulation, tilt=0.2)
    assert simulation.notice == ""


def test_a_slider_does_not_move_a_ring_that_the_mouse_moved():
    simulation = live(TOP)
    simulation.data.mocap_pos[0] = [0.1, 0.0, 0.3]
    put(simulation, friction=0.5)
    np.testing.assert_array_equal(simulation.data.mocap_pos[0], [0.1, 0.0, 0.3])
    put(simulation, height=0.25)
    np.testing.assert_array_equal(simulation.data.mocap_pos[0], [0.0, 0.0, 0.25])


def test_noise_off_is_none():
    simulation = live(DISK)
    simulation.advance(10)
    simulation.switch("noise")
    assert simulation.on == {"magnetism": False, "noise": False}
    simulation.reset()
    simulation.advance(STEPS)
    still = simulated(mm.Disk(noise=0))
    error = abs(simulation.data.qpos[0] - still)
    assert error < 1e-15  # 0, or rounding
    assert abs(still - simulated(DISK)) > 0.1  # 0.44
    put(simulation, temperature=50)
    simulation.reset()
    simulation.switch("noise")
    simulation.advance(STEPS)
    assert abs(simulation.data.qpos[0] - simulated(DISK)) < 1e-15  # 0, or rounding


def test_magnetism_off_leaves_the_ball_at_rest():
    simulation = live(TOP)
    simulation.switch("magnetism")
    start = whole(simulation)
    simulation.advance(STEPS)
    np.testing.assert_array_equal(whole(simulation), start)
    simulation.switch("magnetism")
    simulation.advance(STEPS)
    assert np.abs(simulation.data.qpos[:2] - simulated(TOP)).max() < 3e-16  # 1e-17


@pytest.mark.parametrize("way", ["mjPERT_TRANSLATE", "mjPERT_ROTATE"])
def test_the_mouse_moves_the_magnetic_ball_like_the_same_force(way):
    lived, moved, forced, free = (live(TOP) for _ in range(4))
    perturb, ball = mujoco.MjvPerturb(), lived.model.body("ball").id
    perturb.select, perturb.localmass = ball, 0.2
    perturb.active = int(getattr(mujoco.mjtPertBit, way))
    perturb.refselpos[:] = [0.1, 0.1, 0.0]
    perturb.refquat[:] = [np.cos(0.5), 0.0, np.sin(0.5), 0.0]
    model, data = forced.model, forced.data
    for _ in range(100):
        lived.advance(1, perturb)
        moved.data.xfrc_applied[ball] = 7.0  # as if left there by the viewer's sync
        mm.apply_perturbation(moved.model, moved.data, perturb)
        kept = data.xfrc_applied.copy()
        data.xfrc_applied[:] = 0
        mujoco.mjv_applyPerturbForce(model, data, perturb)
        wrench = data.xfrc_applied[ball].copy()
        data.xfrc_applied[:] = kept
        jacobian = np.zeros((6, model.nv))
        mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], ball)
        data.qfrc_applied[:] = jacobian.T @ wrench
        with mm.magnetism():
            mujoco.mj_step(moved.model, moved.data)
            mujoco.mj_step(model, data)
    np.testing.assert_array_equal(whole(lived), whole(moved))
    error = np.abs(whole(moved) - whole(forced)).max()
    assert error < 2e-13  # 1e-14
    free.advance(100)
    assert np.abs(whole(moved) - whole(free)).max() > 0.1  # 0.35, rotated
    perturb.active = 0
    moved.advance(1, perturb)
    assert not moved.data.qfrc_applied.any()


def test_the_mouse_pulls_a_body_on_which_nothing_else_acts_once():
    body = "<body><freejoint/><geom size='1'/></body>"
    text = f"<mujoco><option gravity='0 0 0'/><worldbody>{body}</worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(text)
    data, perturb = mujoco.MjData(model), mujoco.MjvPerturb()
    mujoco.mj_forward(model, data)
    perturb.select, perturb.localmass, perturb.active = 1, 2.0, 1
    perturb.refselpos[:] = [0.5, 0.0, 0.0]
    data.xfrc_applied[1, 0] = 100.0
    mm.apply_perturbation(model, data, perturb)
    mujoco.mj_step(model, data)
    force = model.vis.map.stiffness * 2.0 * 0.5
    assert data.qacc[0] == pytest.approx(force / model.body_mass[1], rel=1e-15, abs=0)  # 0


def test_the_mouse_pulls_a_body_at_its_center_of_mass():
    """The same as MuJoCo with that force in `xfrc_applied`."""
    body = "<body><freejoint/><geom size='0.1' pos='0.3 0.2 0'/></body>"
    text = f"<mujoco><option gravity='0 0 0'/><worldbody>{body}</worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(text)
    plain, moved, perturb = mujoco.MjData(model), mujoco.MjData(model), mujoco.MjvPerturb()
    perturb.select, perturb.localmass, perturb.active = 1, 2.0, 1
    perturb.refselpos[:] = [0.5, 0.0, 0.3]
    for data, apply in ((plain, mujoco.mjv_applyPerturbForce), (moved, mm.apply_perturbation)):
        mujoco.mj_forward(model, data)
        apply(model, data, perturb)
        mujoco.mj_forward(model, data)
    assert np.abs(plain.qacc).min() > 0.1
    np.testing.assert_allclose(moved.qacc, plain.qacc, rtol=1e-15)  # 0


def test_any_model_starts_at_its_keyframe_and_is_magnetic():
    simulation = LiveSimulation(mujoco.MjModel.from_xml_string(NEEDLE), seed=4)
    assert simulation.declared == {"magnetism": True, "noise": True}
    assert (simulation.data.qpos[0], simulation.data.userdata[0]) == (0.3, 4)
    simulation.advance(200)
    model = mujoco.MjModel.from_xml_string(NEEDLE)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.userdata[0] = 4
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=200)
    assert simulation.data.qpos[0] == data.qpos[0] != 0.3
    mujoco.mj_resetData(simulation.model, simulation.data)
    simulation.apply_input()
    assert (simulation.data.qpos[0], simulation.data.time) == (0.3, 2)


def test_a_model_on_which_nothing_acts_causes_one_warning():
    model = mujoco.MjModel.from_xml_string("<mujoco><worldbody/></mujoco>")
    with pytest.warns(UserWarning, match="nothing acts on this model"):
        simulation = LiveSimulation(model)
    simulation.advance(10)  # where another warning would be an error
    assert simulation.data.time == pytest.approx(
        10 * model.opt.timestep, rel=2e-15, abs=0
    )  # 1.7e-16


def followed(simulation, steps):
    """The readouts after so many steps, each followed by an update."""
    readouts = Readouts(simulation)
    for _ in range(steps):
        simulation.advance(1)
        readouts.update()
    return readouts


@pytest.mark.parametrize("scene", [TOP, MOTOR], ids=["top", "motor"])
def test_readouts_of_a_ball_are_those_of_a_run(scene):
    readouts = followed(live(scene, seed=3), STEPS)
    duration = STEPS * 0.01
    run = mm.simulate(scene, method=METHOD, timestep=0.01, duration=duration, seed=3)
    end, latest = run.isel(time=-1), readouts.latest
    spin = float((end.angular_velocity * end.axis).sum())
    assert latest["J"] == pytest.approx(float(end.momentum_map), rel=1e-14, abs=0)  # 7e-16
    assert latest["spin"] == pytest.approx(spin, rel=1e-14, abs=0)  # 7e-16
    azimuth = float(mm.observables.azimuth(run)[-1])
    assert latest["azimuth"] == pytest.approx(azimuth, rel=5e-15, abs=0)  # 2e-16
    assert readouts.units["J"] == "kg m^2/s"


def test_readouts_of_the_disk_have_its_temperature():
    simulation, means = live(DISK, seed=3), []
    readouts = Readouts(simulation)
    for step in range(STEPS + 1):
        if step:
            simulation.advance(1)
            readouts.update()
        if step % 3 == 0:
            v, omega = simulation.data.qvel
            means.append((v**2 + DISK.sigma * omega**2) / 2)
    v, omega = simulation.data.qvel
    assert readouts.latest["d"] == pytest.approx(DISK.sigma * omega - v, rel=1e-14, abs=0)  # 0
    temperature = np.mean(means[-100:])
    assert readouts.latest["temperature"] == pytest.approx(temperature, rel=6e-15, abs=0)  # 2e-16
    assert readouts.units == {"x": "1", "d": "1", "temperature": "1"}


def test_a_curve_grows_and_a_reset_begins_it_again():
    simulation = LiveSimulation(mujoco.MjModel.from_xml_string(NEEDLE))
    readouts = followed(simulation, 30)
    times, values = readouts.curves
    assert len(times) == 11
    assert [*values] == ["temperature"]
    np.testing.assert_allclose(np.diff(times), 0.006, rtol=1e-12)  # 7e-14
    simulation.reset()
    readouts.update()
    assert len(readouts.curves[0]) == 1


def test_time_before_zero_is_shown_with_its_sign(loop_of):
    text = NEEDLE.replace('time="2"', 'time="-5"')
    loop = loop_of(LiveSimulation(mujoco.MjModel.from_xml_string(text)))
    loop.step(time.perf_counter() + 1, mujoco.MjvPerturb())
    loop.step(time.perf_counter() + 2, mujoco.MjvPerturb())
    assert loop.rows()["time (s)"] == "-4.6"
    assert loop_of(live(TOP)).rows()["time (s)"] == "0.0"


def test_arrows_are_drawn_for_any_model_and_turned_off_without_room(loop_of):
    simulation = LiveSimulation(mujoco.MjModel.from_xml_string(NEEDLE))
    loop, view = loop_of(simulation), mujoco.MjvScene(simulation.model, maxgeom=200)
    loop.draw(view)
    assert (loop.arrows, view.ngeom) == ("moments", 2)
    loop.press(ord("."))
    loop.draw(view)
    assert (loop.arrows, view.ngeom) == ("moments and field", 2 + 121)
    loop.draw(mujoco.MjvScene(simulation.model, maxgeom=100))
    assert loop.arrows == "none"
    assert "view.maxgeom = 100: must be at least" in simulation.notice


def test_a_lost_state_is_reported():
    simulation = live(TOP)
    simulation.advance(10)
    simulation.data.qvel[0] = np.nan
    with pytest.raises(StateLost):
        simulation.advance(1)
    simulation.reset()
    simulation.advance(10)


def test_a_ball_that_is_lifted_off_a_planar_scene_is_reported():
    """With SI moments, simulate's guard stops at t = 0.28 s; on a plane the ball leaves it."""
    planar, plane = live(mm.Top.si()), live(mm.Top.si(surface="plane"))
    planar.advance(20)
    with pytest.raises(StateLost):
        planar.advance(10)
    plane.advance(30)


@pytest.fixture
def slid(rotor, monkeypatch):
    """The device outside the package, which composes an MjSpec; with sliders."""
    device = rotor.RotorDevice

    def sliders(self, scene):
        return {
            "damping": Slider(scene.damping, 1e-9, 1e-3, "N m s"),
            "kT": Slider(scene.kT, 1e-9, 1e-3, "J"),
        }

    monkeypatch.setattr(device, "sliders", sliders)
    monkeypatch.setattr(device, "scene_at", lambda self, scene, values: scene.replace(**values))
    return rotor


@pytest.mark.parametrize("sliders", [{}, {"damping": 5e-5}, {"kT": 2e-4}])
def test_a_device_that_composes_a_spec_is_live(slid, sliders):
    scene = slid.Rotor(rate=0.3)
    simulation = live_scene(scene, timestep=0.002, seed=3)
    put(simulation, **sliders)
    simulation.advance(STEPS)
    assert simulation.notice == ""
    run, plain = (
        mm.simulate(said, method=METHOD, timestep=0.002, duration=STEPS * 0.002, seed=3)
        for said in (scene.replace(**sliders), scene)
    )
    assert abs(simulation.data.qpos[0] - float(run.theta[-1])) < 3e-16  # 0
    assert not sliders or abs(float(run.theta[-1] - plain.theta[-1])) > 0.01  # 0.46


def test_a_spec_without_sliders_is_live_and_has_markers_of_its_size(slid, monkeypatch):
    monkeypatch.setattr(slid.RotorDevice, "sliders", Device.sliders)
    model = live_scene(slid.Rotor(), timestep=0.002).model
    assert (model.nu, model.key_qpos[0, 0]) == (0, 1.0)
    assert model.stat.meansize == model.stat.extent / 20 > 0


@pytest.mark.parametrize("missing", ["keyframe", "joint"])
def test_a_spec_without_keyframe_or_joint_is_a_mistake(slid, monkeypatch, missing):
    def composed(self, scene, *, visual):
        spec = slid.compose(scene, visual=visual)
        spec.delete(spec.keys[0] if missing == "keyframe" else spec.joints[0])
        return spec

    monkeypatch.setattr(slid.RotorDevice, "compose", composed)
    with refused("scene"):
        live_scene(slid.Rotor(), timestep=0.002)


def test_a_joint_without_a_name_holds_the_sliders_and_the_spec_is_unchanged(slid, monkeypatch):
    spec = mujoco.MjSpec.from_string(NEEDLE)
    monkeypatch.setattr(slid.RotorDevice, "compose", lambda self, scene, *, visual: spec)
    model = Panel(slid.Rotor()).model()
    assert [model.actuator(i).name for i in range(model.nu)] == ["damping (N m s)", "kT (J)"]
    np.testing.assert_array_equal(model.key_ctrl[0], [1e-5, 2e-5])
    assert not model.actuator_gainprm.any()
    assert (len(spec.actuators), spec.joints[0].name) == (0, "")


def test_a_model_with_sliders_is_the_scene_otherwise():
    plain, slid = mm.build(MOTOR, visual=True), Panel(MOTOR).model()
    assert (plain.nu, slid.nu) == (0, 3)
    np.testing.assert_array_equal(slid.body_user, plain.body_user)
    np.testing.assert_array_equal(slid.key_qpos, plain.key_qpos)


def test_the_pace_follows_wall_time():
    pace = Pace(2.0, now=10.0)
    taken = sum(pace.steps(10.0 + 0.016 * k, 0.01) for k in range(1, 101))
    assert taken in (319, 320)  # 1.6 s at speed 2; 320
    assert pace.steps(100.0, 0.01) == 40  # the longest frame, 0.2 s, and no more


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("--method", "mujoco/baoab"), "method = 'mujoco/baoab': must be one of mujoco/euler"),
        (("--timestep", "1"), "timestep = 1.0: must be less than"),
        (("--speed", "0"), "speed = 0.0: must be greater than 0"),
        (("--seed", "-1"), "seed = -1: must be at least 0"),
        (("--tilt", "1.5"), "tilt = 1.5: must be less than 0.6289 rad, where the ring"),
    ],
)
def test_a_mistake_is_one_line_and_code_2(run_script, arguments, line):
    code, _, error = run_script("view", "top", *arguments)
    assert code == 2
    assert error.startswith(f"magmotor view: {line}")
    assert error.count("\n") == 1


@pytest.mark.parametrize("text", [None, "<mujoco", '<mujoco><worldbody><body name="a"'])
def test_a_wrong_file_is_one_line_and_code_2(run_script, tmp_path, text):
    path = tmp_path / "model.xml"
    if text:
        path.write_text(text)
    code, _, error = run_script("view", "model", path)
    assert code == 2
    assert error.startswith("magmotor view: ")
    assert error.count("\n") == 1


def test_a_folder_is_not_a_model(run_script, tmp_path):
    code, _, error = run_script("view", "model", tmp_path)
    sentence = "must be a file, not a folder, pipe or device"
    assert (code, error) == (2, f"magmotor view: path = '{tmp_path}': {sentence}\n")


@pytest.fixture
def loop_of():
    """The loop of the command around a simulation, at speed 1."""
    return lambda simulation: Loop(simulation, 1.0, report)


def test_keys_switch_pause_and_change_the_speed(loop_of):
    loop, perturb = loop_of(live(DISK)), mujoco.MjvPerturb()
    keys = ["8: noise", "space", "Backspace"]
    readouts = ["x", "d", "temperature"]
    assert loop.texts()[0].split("\n") == ["time", "6, 7: speed", *readouts, *keys]
    for key in "87 .":
        loop.press(ord(key))
    assert loop.texts()[1].split("\n")[:2] == ["0.0", "2"]
    assert loop.texts()[1].split("\n")[-3:] == ["off", "paused", "reset"]
    loop.step(time.perf_counter() + 1, perturb)
    assert loop.simulation.data.time == 0
    loop.press(ord(" "))
    loop.step(time.perf_counter() + 2, perturb)
    assert loop.simulation.data.time == pytest.approx(
        0.4, rel=4e-15, abs=0
    )  # 4e-16; the longest frame at speed 2
    for key, speed in (("6", 1.0), ("6", 0.5), ("7", 1.0)):
        loop.press(ord(key))
        assert loop.pace.speed == speed


def test_the_help_names_what_keys_do(loop_of):
    loop = loop_of(live(MOTOR))
    lasting = dict(re.findall(r"(\S+) (pauses|slower|faster|noise|magnetism|arrows)", view.HELP))
    assert len(lasting) == 6

    def state():
        return {
            "pauses": loop.paused, "slower": loop.pace.speed < 1, "faster": loop.pace.speed > 1,
            "arrows": loop.arrows, **loop.simulation.on,
        }  # fmt: skip

    for key, word in lasting.items():
        loop = loop_of(live(MOTOR))
        before = state()
        loop.press(ord(" " if key == "space" else key))
        assert [name for name, value in state().items() if value != before[name]] == [word]


@pytest.mark.parametrize("kind", ["model", "motor"])
def test_speed_and_seed_are_those_of_the_command(run_script, tmp_path, monkeypatch, kind):
    loops = []
    monkeypatch.setattr(view, "check_display", lambda: None)
    monkeypatch.setattr(view, "set_mju_user_warning", lambda _: None)
    monkeypatch.setattr(view, "show", lambda loop, _: loops.append(loop))
    (tmp_path / "needle.xml").write_text(NEEDLE)
    what = [tmp_path / "needle.xml"] if kind == "model" else []
    for flags in ([], ["--speed", "3"], ["--seed", "7"], ["--seed", "7"]):
        run_script("view", kind, *what, *flags)
    own = {"model": 1, "motor": 20}[kind]
    assert [loop.pace.speed for loop in loops] == [own, 3, own, own]
    for loop in loops:
        loop.simulation.advance(5, mujoco.MjvPerturb())
    other, unlike, one, same = (whole(loop.simulation) for loop in loops)
    np.testing.assert_array_equal(one, same)
    np.testing.assert_array_equal(other, unlike)
    assert not np.array_equal(one, other)


def test_a_frame_ends_though_its_steps_take_long(loop_of, monkeypatch):
    """By a clock that advances by 0.05 s in each piece of a frame."""
    loop, now, taken = loop_of(live(DISK)), [0.0], []

    def advance(steps, perturb):
        taken.append(steps)
        now[0] += 0.05

    monkeypatch.setattr(loop.simulation, "advance", advance)
    monkeypatch.setattr("magmotor.live.loop.time", SimpleNamespace(perf_counter=lambda: now[0]))
    loop.pace = Pace(1e6, 0.0)
    loop.step(1.0, mujoco.MjvPerturb())
    assert sum(taken) <= 5 * PIECE
    loop.pace, taken[:] = Pace(3.1, 0.0), []
    loop.step(0.2, mujoco.MjvPerturb())
    assert sum(taken) == 62


def test_a_warning_is_a_notice_of_the_view(capsys, monkeypatch):
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    simulation = live(TOP)
    warn_in_one_line()
    view.show_warnings(simulation)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.warn("the magnets have met", stacklevel=1)
    assert simulation.notice == "the magnets have met"
    assert capsys.readouterr().err.endswith(": the magnets have met\n")


def test_a_lost_state_starts_again_paused(loop_of, capsys):
    loop = loop_of(live(TOP))
    loop.simulation.data.qvel[0] = np.inf
    loop.step(time.perf_counter() + 1, mujoco.MjvPerturb())
    assert loop.paused
    assert "the state is not finite at t = 0: reset and paused" in loop.texts()[0]
    np.testing.assert_array_equal(whole(loop.simulation), whole(live(TOP)))
    assert capsys.readouterr().err.endswith("the state is not finite at t = 0: reset and paused\n")


@pytest.mark.skipif(sys.platform != "linux", reason="X11 is Linux's")
def test_without_a_display_it_is_one_line_and_code_3():
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-m", "magmotor", "view", "top"],
        env=environment, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 3
    assert done.stderr.startswith("magmotor view: no window: ")
    assert done.stderr.count("\n") == 1


DRIVER = """
import sys, threading
from types import SimpleNamespace
sys.argv = {arguments!r}
import mujoco.viewer
from magmotor.commands import view
launch, step = mujoco.viewer.launch_passive, view.Loop.step
seen = SimpleNamespace(frames=0)

def launch_passive(*arguments, key_callback, **options):
    seen.viewer, seen.press = launch(*arguments, key_callback=key_callback, **options), key_callback
    return seen.viewer

def stepped(loop, now, perturb):
    data = loop.simulation.data
    frame, seen.frames = seen.frames, seen.frames + 1
    pair = loop.simulation.model.pair_solreffriction[0, 1]
    if frame == 0:
        seen.pair = pair
    if frame == 5:
        data.actuator("friction (kg/s)").ctrl = 0.5
    if frame == 10:
        perturb.select = loop.simulation.model.body("ball").id
        perturb.active, perturb.localmass = 1, 0.2
        perturb.refselpos[:] = [0.0, 0.3, 0.0]
        seen.before = data.qpos[1]
    step(loop, now, perturb)
    if frame == 20:
        perturb.active = 0
        print("pulled", data.qpos[1] - seen.before)
        print("friction", pair / seen.pair)
        seen.press(ord(" "))
    if frame == 25:
        texts = dict(zip(*[column.split("\\n") for column in loop.texts()], strict=True))
        print(texts["space"], seen.viewer.viewport.width > 100)
        print("J", texts["J (kg m^2/s)"])
        print("arrows", seen.viewer.user_scn.ngeom)
        seen.press(ord("."))
    if frame == 27:
        print("moments", seen.viewer.user_scn.ngeom)
        seen.viewer.close()

mujoco.viewer.launch_passive, view.Loop.step = launch_passive, stepped
view.main()
print("closed", threading.active_count())
"""


@pytest.fixture(scope="module")
def display():
    """A virtual display, where Xvfb is installed."""
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb: install xvfb (Debian) or xorg-x11-server-Xvfb (Fedora)")
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "900x600x24"]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as told:
        number = told.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait(60)


@pytest.mark.slow
def test_in_a_window_sliders_keys_and_mouse_act_and_it_closes(display):
    arguments = ["magmotor view", "top", "--position", "-0.1", "-0.05"]
    driver = DRIVER.format(arguments=arguments)
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", driver],
        env=os.environ | {"DISPLAY": display}, capture_output=True, text=True, timeout=120,
        check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    told = dict(line.split(maxsplit=1) for line in done.stdout.splitlines()[-7:])
    assert float(told["pulled"]) > 0.01
    assert float(told["friction"]) == pytest.approx(5 / 3, rel=1e-15, abs=0)  # 0
    assert (told["paused"], told["closed"]) == ("True", "1")
    assert float(told["J"]) != 0
    assert (told["arrows"], told["moments"]) == ("0", "21")


SHOWN = """
import sys, threading
sys.argv = {arguments!r}
from magmotor.commands import view
from magmotor.commands.output import run_program
step = view.Loop.step

def stepped(loop, now, perturb):
    view.Loop.step = step
    print("shown", flush=True)
    step(loop, now, perturb)

view.Loop.step = stepped
try:
    run_program(view.main)
finally:
    print("threads", threading.active_count())
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "line", "seconds"),
    [("top", "keys: ", 0), ("disk", "keys: ", 0.3), ("motor", "shown", 0), ("model", "shown", 0.5)],
)
def test_a_window_that_is_interrupted_closes_with_one_line(display, tmp_path, kind, line, seconds):
    """So many seconds after a line: when there is no window yet, while it opens, and later."""
    needle = tmp_path / "needle.xml"
    needle.write_text(NEEDLE)
    arguments = ["magmotor view", kind, *([str(needle)] if kind == "model" else [])]
    driver = SHOWN.format(arguments=arguments)
    window = subprocess.Popen(
        [sys.executable, "-W", "error", "-c", driver],
        env=os.environ | {"DISPLAY": display}, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    try:
        assert window.stdout is not None
        assert any(said.startswith(line) for said in window.stdout)
        time.sleep(seconds)
        window.send_signal(signal.SIGINT)
        said, error = window.communicate(timeout=60)
    finally:
        window.kill()
    assert said.endswith("threads 1\n")
    assert (window.returncode, error) == (130, "magmotor view: interrupted\n")
