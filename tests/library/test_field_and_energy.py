"""Field and energy of any model's dipoles, against closed forms and the forces that act."""

import mujoco
import numpy as np
import pytest
from energy_slopes import forces_by_energy

import magmotor as mm

CHAIN = """
<mujoco>
  <option gravity="0 0 0"/>
  <custom>
    <text name="magmotor" data="dipoles couplings"/>
    <tuple name="coupling of arm and world">
      <element objtype="body" objname="world" prm="3"/>
      <element objtype="body" objname="arm" prm="3"/>
    </tuple>
  </custom>
  <worldbody>
    <site pos="0.3 0 0.1" euler="20 40 0" user="5"/>
    <site pos="-0.3 0.1 0" user="-2"/>
    <body name="arm" pos="0 0 0.2">
      <joint type="ball"/>
      <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.01"/>
      <site pos="0.05 0 0" euler="0 70 10" user="3"/>
      <body name="hand" pos="0.1 0 0">
        <joint type="hinge" axis="0 1 1"/>
        <joint type="slide" axis="1 0 0"/>
        <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.01"/>
        <site pos="0.05 0 0" euler="90 0 10" user="1.5"/>
        <body name="tool" pos="0.05 0 0.05"><site euler="0 30 0" user="0.7"/></body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def chain():
    model = mujoco.MjModel.from_xml_string(CHAIN)
    data = mujoco.MjData(model)
    data.qpos[4:] = 0.4, 0.02
    mujoco.mj_forward(model, data)
    return model, data


def test_generalized_forces_are_the_gradient_of_the_energy(chain):
    model, data = chain
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    found = np.zeros(model.nv)
    for body in range(1, model.nbody):
        wrench = data.xfrc_applied[body]
        mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], data.xipos[body], body, found)
    errors = abs(found - forces_by_energy(model, data, 3e-6))
    assert errors.max() < 3e-8 * abs(found).max()  # 2e-9


def test_data_without_positions_are_an_error(chain):
    """As they are new, and after a reset."""
    model, data = chain
    mujoco.mj_resetData(model, data)
    view = mujoco.MjvScene(model, 100)
    for each in (data, mujoco.MjData(model)):
        for compute in (
            lambda each=each: mm.magnetic_energy(model, each),
            lambda each=each: mm.field(model, each, [0, 0, 1]),
            lambda each=each: mm.draw_moments(view, model, each),
        ):
            with pytest.raises(ValueError, match=r"not known before mujoco\.mj_forward"):
                compute()
        mujoco.mj_kinematics(model, each)
        assert np.isfinite(mm.magnetic_energy(model, each))


def test_the_field_is_the_sum_of_the_sites(chain):
    """By the closed form mu0/(4 pi r^3) (3 (m.n) n - m), written out."""
    model, data = chain
    points = np.random.default_rng(1).normal(size=(4, 2, 3))
    expected = np.zeros_like(points)
    for i in range(model.nsite):
        moment = model.site_user[i, 0] * data.site_xmat[i].reshape(3, 3)[:, 2]
        r = points - data.site_xpos[i]
        distance = np.linalg.norm(r, axis=-1, keepdims=True)
        n = r / distance
        expected += 1e-7 * (3 * (n @ moment)[..., None] * n - moment) / distance**3
    found = mm.field(model, data, points)
    assert abs(found - expected).max() < 1e-14 * abs(expected).max()  # 3.9e-16


TRIANGLE = """
<mujoco>
  <custom>{mark}{tuples}</custom>
  <worldbody>
    <body name="ground"><site pos="0.3 0 0.1" euler="20 40 0" user="5"/></body>
    <site pos="-0.1 0.2 0.1" euler="0 40 10" user="4"/>
    <body name="post" mocap="true" pos="0 0.3 0"><site user="2"/></body>
    <body name="arm" pos="0 0 0.2">
      <freejoint/><geom size="0.01"/><site euler="0 70 10" user="3"/>
      <body name="tool" pos="0.1 0 0"><site user="-1.5"/></body>
    </body>
    <body name="needle" pos="0.1 0.2 -0.1"><freejoint/><geom size="0.01"/><site user="7"/></body>
  </worldbody>
</mujoco>
"""
"""`ground` and the world are welded, as are `arm` and `tool`; `post` is another fixed body."""

MOVING = (
    ("ground", "arm"), ("ground", "tool"), ("ground", "needle"), ("world", "arm"),
    ("world", "tool"), ("world", "needle"), ("post", "arm"), ("post", "tool"), ("post", "needle"),
    ("arm", "needle"), ("tool", "needle"),
)  # fmt: skip


def coupling(name, one, other, factor):
    return f'''<tuple name="coupling{name}">
      <element objtype="body" objname="{one}" prm="{factor}"/>
      <element objtype="body" objname="{other}" prm="{factor}"/></tuple>'''


TWICE = coupling(1, "arm", "needle", 3) + coupling(2, "needle", "arm", 0.5)
RIGID = coupling(3, "arm", "tool", 2) + coupling(4, "world", "post", 2)
MARK = '<text name="magmotor" data="dipoles couplings"/>'


@pytest.mark.parametrize(
    ("mark", "tuples", "factors"),
    [
        (MARK, "", {}),
        (MARK, TWICE, {("arm", "needle"): 1.5}),
        (MARK, RIGID, {}),
        (MARK, coupling("", "ground", "tool", 0), {("ground", "tool"): 0}),
        (MARK, TWICE.replace("coupling", "gears"), {}),
        ('<text name="magmotor" data="dipoles"/>', TWICE, {}),
        ("", TWICE, {}),
    ],
)
def test_the_pairs_and_their_energy_written_out(mark, tuples, factors):
    """Sum of c mu0/(4 pi r^3) (m.m' - 3 (m.n) (m'.n)); rigid and fixed pairs have none."""
    model = mujoco.MjModel.from_xml_string(TRIANGLE.format(mark=mark, tuples=tuples))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pairs = {pair: factors.get(pair, 1.0) for pair in MOVING}
    of_body = {model.body(int(b)).name: i for i, b in enumerate(model.site_bodyid)}
    moments = model.site_user * data.site_xmat.reshape(-1, 3, 3)[:, :, 2]
    expected, size = 0.0, 0.0
    for (one, other), factor in pairs.items():
        i, j = of_body[one], of_body[other]
        r = data.site_xpos[i] - data.site_xpos[j]
        distance = np.linalg.norm(r)
        n = r / distance
        angular = moments[i] @ moments[j] - 3 * (moments[i] @ n) * (moments[j] @ n)
        expected += factor * 1e-7 * angular / distance**3
        size += abs(factor * 1e-7 * angular / distance**3)
    assert abs(mm.magnetic_energy(model, data) - expected) < 6e-15 * size  # 2.1e-16
    found = {frozenset(pair): factor for pair, factor in mm.describe(model).pairs.items()}
    assert found == {frozenset(pair): factor for pair, factor in pairs.items() if factor}


def test_a_model_without_dipoles_has_neither():
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    data = mujoco.MjData(model)
    assert mm.magnetic_energy(model, data) == 0
    assert not mm.field(model, data, [[1, 2, 3]]).any()


def test_the_energy_is_the_top_s():
    scene = mm.Top.paper(4)
    run = mm.simulate(scene, method="variational/verlet", timestep=0.01, duration=1.0)
    model = mm.build(scene)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    kinetic = 0.0  # it starts at rest
    assert mm.magnetic_energy(model, data) + kinetic == pytest.approx(
        float(run.energy[0]),
        rel=1e-15,  # measured: 0
    )
