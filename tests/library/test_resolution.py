"""A run warns of magnets that jump within a timestep or sink into each other, and of no others."""

import sys
import threading
import time
import warnings

import mujoco
import mujoco.rollout
import numpy as np
import pytest

import magmotor as mm

JUMPED = (
    "within one timestep, magnetism moved body {} by about its size, or alone would turn it by more"
    " than 4 rad from rest, so that it may fly apart"
)
SUNK = "body {} has sunk into body {} by more than a quarter of its width"

MODEL = """
<mujoco>
  {plugin}
  <option gravity="0 0 0" integrator="{integrator}" timestep="{timestep}"/>
  <custom><text name="magmotor" data="dipoles fields"/>{custom}</custom>
  <worldbody>{bodies}</worldbody>
</mujoco>"""
PLUGIN = """<extension><plugin plugin="magmotor.forces"><instance name="magnets">
  <config key="act" value="dipoles fields"/></instance></plugin></extension>"""
BALL = """
<body pos="0 0 {}">
  <freejoint/><geom type="{}" size="0.005 0.005 0.005" density="7500" {}/><site user="{}"/>
</body>"""


def model_of(bodies, *, custom="", plugin=False, integrator="Euler", timestep=2e-3):
    return mujoco.MjModel.from_xml_string(
        MODEL.format(bodies=bodies, custom=custom, plugin=PLUGIN * plugin, integrator=integrator,
                     timestep=timestep)
    )  # fmt: skip


def balls(distance, geom="", moment=0.54, shape="sphere", **options):
    """Two balls, or cubes, that attract each other."""
    bodies = (BALL.format(place, shape, geom, moment) for place in (0, distance))
    return model_of("".join(bodies), **options)


def warnings_of(models, duration):
    """What is said while several models run in turns, and their last data."""
    data = [mujoco.MjData(model) for model in models]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(int(duration / models[0].opt.timestep)):
            for model, each in zip(models, data, strict=True):
                mujoco.mj_step(model, each)
    return [str(warning.message) for warning in caught], data


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
@pytest.mark.parametrize("geom", ["", 'contype="0" conaffinity="0"'])
@pytest.mark.parametrize("distance", [0.02, 0.021, 0.025])
def test_a_run_warns_once_of_magnets_that_fly_apart(distance, geom, integrator):
    """With contacts that are too soft, and without any."""
    models = [balls(distance, geom, integrator=integrator) for _ in range(2)]
    for _ in range(2):
        with mm.magnetism():
            (message,), data = warnings_of(models, 0.3)
        speeds = [np.linalg.norm(each.qvel[:3]) for each in data]
        assert min(speeds) > 1  # 3.3 .. 1e4
        assert message.startswith((JUMPED.format(1), JUMPED.format(2), SUNK.format(1, 2)))
        assert "mm.check(model) proposes" in message


@pytest.mark.parametrize(("later", "said"), [(1.0, 1), (3.0, 0)])
def test_a_velocity_is_compared_one_step_later_only(later, said):
    """What a user sets after several steps' time is no jump."""
    model = balls(0.012, 'contype="0" conaffinity="0"')
    data = mujoco.MjData(model)
    with mm.magnetism(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mujoco.mj_forward(model, data)
        data.time = later * model.opt.timestep
        data.qpos[2], data.qvel[:] = -1.0, 0.0
        data.qvel[[2, 8]] = -100.0
        mujoco.mj_forward(model, data)
    assert len(caught) == said


def test_the_plugin_warns_once_until_other_data_are_made():
    models = [balls(0.021, plugin=True) for _ in range(2)]
    for model in (*models, models[1]):
        (message,), _ = warnings_of([model, model], 0.3)
        assert message.startswith((JUMPED.format(1), SUNK.format(1, 2)))


def test_the_plugin_warns_of_each_of_many_models():
    """Also if a new model has the address of one that is gone."""
    for _ in range(6):
        messages, _ = warnings_of([balls(0.021, plugin=True)], 0.3)
        assert len(messages) == 1


def test_magnets_that_something_holds_do_not_hide_a_jump():
    held = """<body name="held" pos="0 .2 {z}"><joint type="slide" axis="0 0 1" damping="1e6"/>
    <geom size=".002" contype="0" conaffinity="0"/><site user=".54"/></body>"""
    free = """<body name="{name}" pos="0 0 {z}"><freejoint/>
    <geom size=".005" density="7500" contype="0" conaffinity="0"/><site user=".54"/></body>"""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0"/><custom><text name="magmotor" data="dipoles"/></custom>'
        f"<worldbody>{held.format(z=0).replace('held', 'one')}{held.format(z=0.006)}"
        f"{free.format(name='a', z=0)}{free.format(name='b', z=0.021)}</worldbody></mujoco>"
    )
    with mm.magnetism():
        (message,), (data,) = warnings_of([model], 0.3)
    assert message.startswith((JUMPED.format("'a'"), JUMPED.format("'b'")))
    assert np.linalg.norm(data.body("a").cvel) > 10


@pytest.mark.parametrize("plugin", [False, True])
def test_the_body_is_named(plugin):
    spec = mujoco.MjSpec.from_string(MODEL.format(
        plugin=PLUGIN * plugin, integrator="Euler", timestep=2e-3, custom="",
        bodies="".join(BALL.format(place, "sphere", "", 0.54) for place in (0, 0.021)),
    ))  # fmt: skip
    for body, name in zip(spec.bodies[1:], ("left", "right"), strict=True):
        body.name = name
    model = spec.compile()
    with mm.magnetism():
        (message,), _ = warnings_of([model], 0.3)
    assert message.startswith((JUMPED.format("'left'"), SUNK.format("'left'", "'right'")))


INERTIAL = '<inertial pos="0 0 0" mass="4e-3" diaginertia="4e-8 4e-8 4e-8"/>'
SITE = '<site user="0.54"/>'
WITHOUT_GEOMS = {
    "alone": INERTIAL + SITE,
    "in a child": f"{INERTIAL}<body>{SITE}</body>",
    "in a child with the mass": f"<body>{INERTIAL}{SITE}</body>",
    "in a child of a ball": (f'<geom size="0.005" density="7500" contype="0"/><body>{SITE}</body>'),
}


@pytest.mark.parametrize("name", WITHOUT_GEOMS)
def test_magnets_without_geoms_are_seen(name):
    """The size is that of the body to which they belong, or that of a ball of the same inertia."""
    bodies = (
        f'<body pos="0 0 {place}"><freejoint/>{WITHOUT_GEOMS[name]}</body>' for place in (0, 0.021)
    )
    model = model_of("".join(bodies))
    with mm.magnetism():
        (message,), (data,) = warnings_of([model], 0.1)
    assert "magnetism moved body" in message
    assert abs(data.qvel).max() > 3  # 50


def test_a_run_does_not_hide_the_jumps_of_another():
    """The other one meets the conditions in each step, but strong damping keeps it from moving."""
    held = model_of("".join(
        f'<body pos="0 0 {place}"><joint type="slide" axis="0 0 1" damping="1e6"/>'
        '<geom size="0.005" contype="0"/><site user="0.54"/></body>' for place in (0, 0.006)
    ))  # fmt: skip
    free = balls(0.021, 'contype="0" conaffinity="0"')
    with mm.magnetism():
        assert warnings_of([held], 0.1)[0] == []
        # Two of them miss each other's jumps only if they share words with the held one.
        (message,), _ = warnings_of([free, held, free], 0.3)
    assert "magnetism moved body" in message


def test_threads_that_find_a_jump_at_the_same_time_warn_once():
    """They wait for Python, which this thread keeps busy until all have found it."""
    model = balls(0.021, timestep=2e-6)
    state = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros((4, mujoco.mj_stateSize(model, state)))
    mujoco.mj_getState(model, mujoco.MjData(model), start[0], state)
    start[:] = start[0]
    interval = sys.getswitchinterval()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with mm.magnetism(), mujoco.rollout.Rollout(nthread=4) as rollout:
            many = [mujoco.MjData(model) for _ in range(4)]
            thread = threading.Thread(
                target=rollout.rollout, args=(model, many, start), kwargs={"nstep": 5000}
            )
            try:
                sys.setswitchinterval(60.0)
                thread.start()
                time.sleep(0.001)  # until the thread is in MuJoCo
                end = time.perf_counter() + 0.3
                while time.perf_counter() < end:
                    pass
            finally:
                sys.setswitchinterval(interval)
                thread.join()
    assert len(caught) == 1


def test_a_run_at_the_proposed_settings_does_not_warn():
    model = balls(0.021)
    mm.check(model, fix=True)
    with mm.magnetism():
        assert warnings_of([model], 0.05)[0] == []


@pytest.mark.parametrize(("shape", "softness", "count"), [
    ("sphere", 0.6, 0), ("sphere", 1.0, 1), ("box", 0.6, 0), ("box", 1.3, 1),
])  # fmt: skip
def test_magnets_that_sink_too_deep_are_reported(shape, softness, count):
    """They stick; balls sink in by 0.28 and 0.55 of their radius, of which a half is reported."""
    model = balls(0.015, shape=shape)
    mass, distance = model.body_mass[1] / 2, 0.01
    force = 3 * 2e-7 * 0.54**2 / distance**4
    time = np.sqrt(distance * mass / force)
    model.geom_solref[:] = softness * time, 1
    model.opt.timestep = softness * time / 10
    with mm.magnetism():
        messages, (data,) = warnings_of([model], 100 * time)
    gap = np.linalg.norm(data.xpos[2] - data.xpos[1])
    assert 0.008 < gap < 0.01
    assert len(messages) == count
    assert all(message.startswith(SUNK.format(1, 2)) for message in messages)


LINKED = """
<body name="one"><joint type="hinge" axis="0 1 0"/><geom size="0.005"/><site user="0.1"/>
  <body pos="0 0 .02"><joint type="hinge" axis="0 1 0"/><geom size="0.002"/>
    <body name="two" pos="0 0 -.013"><joint type="slide" axis="0 0 1"/><geom size="0.005"/>
      <site user="0.1"/></body></body></body>"""


@pytest.mark.parametrize("plugin", [False, True])
def test_links_of_one_tree_may_overlap(plugin):
    model = model_of(LINKED, plugin=plugin)
    data = mujoco.MjData(model)
    with mm.magnetism(), pytest.warns(UserWarning, match="has sunk"):
        mujoco.mj_forward(model, data)
    assert data.contact.dist.min() < -0.0026  # -0.003


@pytest.mark.parametrize("plugin", [False, True])
@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_magnets_that_overlap_at_the_start_are_an_error(shape, plugin):
    """The depth is 0.24 or 0.26 of the width; later, and without a contact, it is no error."""
    for depth, geom, began in (
        (0.0024, "", 0.0),
        (0.0026, 'contype="0" conaffinity="0"', 0.0),
        (0.0026, "", 1.0),
    ):
        data = mujoco.MjData(model := balls(0.01 - depth, geom, shape=shape, plugin=plugin))
        data.time = began
        with mm.magnetism(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mujoco.mj_forward(model, data)
    model = balls(0.01 - 0.0026, shape=shape, plugin=plugin)
    with mm.magnetism(), pytest.raises(mujoco.FatalError):
        mujoco.mj_step(model, mujoco.MjData(model))


CLOTH = """
<body pos="0 0 0.012"><freejoint/><geom size="0.02" density="7500"/><site user="0.5"/></body>
<site pos="0 0 -1" user="0.5"/><geom type="plane" size="1 1 1" pos="0 0 -0.1"/>
<flexcomp type="grid" count="4 4 1" spacing=".03 .03 .03" radius=".01" name="cloth" dim="2"
  mass=".1">
  <contact selfcollide="none"/><edge equality="true"/><pin id="0 3 12 15"/>
</flexcomp>"""


@pytest.mark.parametrize("plugin", [False, True])
def test_contacts_of_what_is_no_magnet_are_not_reported(plugin):
    """A flexible grid, which has no geoms, and a floor of a world that has a dipole."""
    model = model_of(CLOTH, plugin=plugin)
    data = mujoco.MjData(model)
    flexes = 0
    with mm.magnetism():
        for _ in range(100):
            mujoco.mj_step(model, data)
            flexes += (data.contact.geom < 0).any()
    assert flexes > 10


FLOOR = """
<site pos="0 0 -1" user="0.5"/><geom type="plane" size="1 1 1" pos="0 0 -0.002"/>"""


def test_a_floor_is_no_magnet_even_if_the_world_has_one():
    model = model_of(BALL.format(-0.001, "box", "", 0.5) + FLOOR)
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_step(model, data)
    assert data.contact.dist.min() < -0.0026  # -0.004


NEEDLE = """
<body>
  <joint type="{}" axis="0 0 1" damping="{}"/>
  <inertial pos="0 0 0" mass="1" diaginertia="{} {} {}"/>
  <geom type="capsule" fromto="0 -0.03 0 0 0.03 0" size="0.003"/><site zaxis="0 1 0" user="0.1"/>
</body>"""


@pytest.mark.parametrize(("joint", "inertia"), [
    ("hinge", (1, 1, 4e-5)), ("hinge", (2e-5, 2e-5, 4e-5)),
    ("ball", (4e-5, 4e-7, 4e-5)), ("ball", (4e-5, 4e-5, 4e-5)),
])  # fmt: skip
@pytest.mark.parametrize(("product", "damping", "count"), [(1.98, 0, 0), (2.02, 0, 1), (4, 1, 0)])
def test_a_needle_that_turns_too_fast_is_reported(product, damping, count, joint, inertia):
    """It starts at 90 degrees from the field, where the torque is m B = 0.1 N m.

    It does not matter how much inertia it has about other axes. Strong damping prevents a jump.
    """
    omega = np.sqrt(0.1 / 4e-5)
    model = model_of(
        NEEDLE.format(joint, damping, *inertia), timestep=product / omega,
        custom='<numeric name="field" data="1 0 0"/>',
    )  # fmt: skip
    with mm.magnetism():
        messages, _ = warnings_of([model], 300 * model.opt.timestep)
    assert [message[: len(JUMPED) - 1] for message in messages] == [JUMPED.format(1)] * count
