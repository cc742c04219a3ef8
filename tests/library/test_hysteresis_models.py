"""Rods with hysteresis in a model: what they remember, their declaration and its errors."""

import copy
import math

import mujoco
import mujoco.rollout
import numpy as np
import pytest
from refusals import misdeclared, refused
from rods import (
    B_C,
    COERCIVITY,
    CURRENT,
    EARTH,
    LOCKED,
    MODEL,
    MOMENT,
    MU0,
    PLUGIN,
    REMANENCE,
    ROD,
    SATELLITE,
    loaded,
)  # fmt: skip

import magmotor as mm


def test_at_rest_nothing_changes():
    """However often forces are computed; a step without motion remembers what they are."""
    model, data = loaded()
    mujoco.mj_forward(model, data)
    first = data.plugin_state.copy(), data.qfrc_passive.copy(), mm.magnetic_energy(model, data)
    assert first[0].tolist() == [0.0, pytest.approx(EARTH - B_C, rel=1e-15, abs=0)]
    for _ in range(3):
        mujoco.mj_forward(model, data)
        assert mm.magnetic_energy(model, data) == first[2]
    assert data.plugin_state.tolist() == first[0].tolist()
    mujoco.mj_step(model, data, nstep=5)
    assert data.plugin_state.tolist() == 2 * [first[0][1]]
    assert data.qfrc_passive.tolist() == first[1].tolist() == [0.0]


def spun(model, data, steps):
    mujoco.mj_step(model, data, nstep=steps)
    return [*data.qpos, *data.qvel, *data.plugin_state]


def test_the_memory_is_a_part_of_the_state():
    model, data = loaded(integrator="Euler")
    data.qvel[0] = 1.0
    mujoco.mj_step(model, data, nstep=400)
    kind = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    others = [copy.copy(data), mujoco.MjData(model), mujoco.MjData(model)]
    mujoco.mj_setState(model, others[1], state, kind)
    mujoco.mj_forward(model, others[1])
    others[2].qpos[:], others[2].qvel[:] = data.qpos, data.qvel
    states, _ = mujoco.rollout.rollout(model, mujoco.MjData(model), state[None], nstep=20)
    expected = spun(model, data, 20)
    assert spun(model, others[0], 20) == spun(model, others[1], 20) == expected
    assert spun(model, others[2], 20) != expected  # which knows nothing
    assert states[0, -1, 1:].tolist() == expected  # without the time
    mujoco.mj_resetData(model, data)
    assert data.plugin_state.tolist() == [0.0, 0.0]
    mujoco.mj_setState(model, data, state, kind)
    mujoco.mjd_transitionFD(model, data, 1e-6, True, np.empty((2, 2)), None, None, None)
    assert spun(model, data, 20) == expected


def test_euler_and_rk4_agree_to_first_order():
    ends = {}
    for steps in (400, 800):
        for integrator in ("Euler", "RK4"):
            model, data = loaded(timestep=10 / steps, integrator=integrator)
            data.qvel[0] = 1.0
            ends[integrator, steps] = np.array(spun(model, data, steps)[:2])
    reference = ends["RK4", 800]
    errors = [abs(ends["Euler", steps] - reference).max() for steps in (400, 800)]
    assert errors[0] < 1e-6  # 6e-8
    assert errors[1] < 0.6 * errors[0]  # 0.5
    assert abs(ends["RK4", 400] - reference).max() < 0.2 * errors[1]  # 0.07


def test_what_has_none_has_the_same_bits_and_no_state():
    """The word alone changes nothing, nor do tuples without the word."""
    runs = []
    for act, hidden in (("dipoles fields", ""), ("all", ""), ("dipoles fields", "hysteresis")):
        spec = mujoco.MjSpec.from_string(
            MODEL.format(
                bodies=SATELLITE, rods=ROD.format("rod"), timestep=0.01, integrator="RK4",
                plugin=PLUGIN, act=act, more="", field=f"{EARTH} 0 1e-5", loop="12 0.16",
                actuators="",
            )
        )  # fmt: skip
        spec.tuples[0].name = hidden or "rods"
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qvel[0] = 1.0
        mujoco.mj_step(model, data, nstep=100)
        runs.append([*data.qpos, *data.qvel])
        assert model.npluginstate == (2 if hidden else 0)
    assert runs[0] == runs[1] == runs[2]


def test_other_units_give_the_same_motion():
    """In mm instead of m, which flux densities do not have."""
    ends = []
    for per in (1, 1000):
        bodies = f"""
        <body><joint type="hinge" axis="0 0 1" armature="{1e-3 * per**2!r}"/>
          <geom size=".01" mass="1e-9"/>
          <site name="rod" zaxis="1 0 0" user="{MOMENT * per**2!r}"/></body>"""
        model, data = loaded(
            bodies, loop=f"{COERCIVITY / per!r} {REMANENCE}",
            more=f'<numeric name="magnetic_constant" data="{MU0 * per!r}"/>',
        )  # fmt: skip
        data.qvel[0] = 1.0
        ends.append(spun(model, data, 300))
    assert ends[0] == pytest.approx(ends[1], rel=1e-9, abs=0)


def test_what_is_said_of_rods():
    model, data = loaded()
    found = mm.describe(model)
    assert found.acting == ("dipoles", "fields", "hysteresis")
    assert found.hysteresis == {"rod": (COERCIVITY, REMANENCE)}
    assert "hysteresis: rod 12 A/m, remanence 0.16 of saturation" in repr(found)
    assert not mm.check(model, data).findings


def test_a_spec_gets_them():
    spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{SATELLITE}</worldbody></mujoco>")
    mm.add_field(spec, [EARTH, 0, 0])
    mm.add_hysteresis(spec, [spec.site("rod")], COERCIVITY, REMANENCE)
    for ratio in (0, 1):
        with refused("remanence"):
            mm.add_hysteresis(spec, [spec.site("rod")], 1, ratio, name="hysteresis 2")
    model = spec.compile()
    assert mm.describe(model).hysteresis == {"rod": (COERCIVITY, REMANENCE)}
    assert model.npluginstate == 2


@pytest.mark.parametrize("loop", [[0.0, 0.5], [1.0, 0.0], [1.0, 1.0], [math.inf, 0.5]])
def test_loops_have_a_coercivity_and_a_remanence(loop):
    model, _ = loaded()
    first = model.numeric("loop").id
    start = model.numeric_adr[first]
    model.numeric_data[start : start + 2] = loop
    with misdeclared("loop", first):
        mm.describe(model)


COIL = """
<tuple name="coil"><element objtype="actuator" objname="current"/>
  <element objtype="site" objname="rod"/></tuple>"""
IRON = """
<numeric name="steel" data="1000"/>
<tuple name="iron"><element objtype="numeric" objname="steel"/>
  <element objtype="geom" objname="{}"/></tuple>"""
SHAPES = '<geom name="floor" type="plane" pos="0 0 -1" size="1 1 1"/><geom name="ball" size=".01"/>'


@pytest.mark.parametrize(
    ("sentence", "changes"),
    [
        ("element 2, site 'rod', is also named by", {"rods": ("rod", "rod")}),
        ("must name a numeric, its loop, and a site", {"rods": ()}),
        ("is also driven by coil tuple", {"more": COIL, "bodies": LOCKED, "actuators": CURRENT}),
        ("iron, such as geom 0 'floor', must", {"more": IRON.format("floor")}),
        ("iron, such as geom 1 'ball', must", {"more": IRON.format("ball")}),
        (
            "as body 1 'satellite' does",
            {"bodies": SATELLITE.replace("><j", " user='1 0 0 0 0 0'><j")},
        ),
        ("between 0 and 1", {"loop": "12"}),
        ("must not be negative", {"bodies": SATELLITE.replace('user="', 'user="-')}),
    ],
)
def test_what_cannot_be_is_an_error(sentence, changes):
    given = {"bodies": SHAPES + SATELLITE} | changes
    with pytest.raises(ValueError, match=sentence):
        loaded(**given, act="all")
    loaded(**given, act="dipoles fields")


def test_the_block_stores_nothing():
    model, data = loaded(plugin="")
    with misdeclared("unstored", 0):
        mm.describe(model)
    with (
        mm.magnetism(),
        pytest.raises(mujoco.FatalError, match=r"the plugin magmotor\.forces stores"),
    ):
        mujoco.mj_step(model, data)


def test_what_has_no_noise_or_potential_for_them_says_so():
    model, _ = loaded()
    with pytest.raises(ValueError, match="Langevin has no noise for hysteresis"):
        mm.Langevin(model, kT=1e-20)
    with pytest.raises(ValueError, match="leave the word hysteresis out of the mark"):
        mm.metropolis(model, kT=1e-20, samples=2)
