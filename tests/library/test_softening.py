"""Soft constraints suit the timestep of `mm.Langevin` in every pose, or are refused."""

import mujoco
import numpy as np
import pytest
from refusals import refused

import magmotor as mm

STEP = 0.002

ARM = f"""
<mujoco>
  <option timestep="{STEP}"/>
  <worldbody>
    <body>
      <joint name="pan" axis="0 0 1" damping="0.1" armature="0.003" RANGE/>
      <geom type="sphere" size="0.02" mass="0.1" contype="0"/>
      <body>
        <joint name="lift" axis="0 1 0" damping="0.1"/>
        <geom type="capsule" fromto="0 0 0 1 0 0" size="0.02" mass="1" contype="0"/>
      </body>
    </body>
  </worldbody>
  MORE
</mujoco>
"""
"""An arm that is stretched at `qpos0`; lifted, it hardly resists its pan."""

LIMITED_TENDON = """<tendon>
  <fixed limited="true" range="-0.16 0.16"><joint joint="pan" coef="2"/></fixed>
</tendon>"""

CONSTRAINTS = {
    "joint limits": ('range="-5 5"', ""),
    "tendon limits": ("", LIMITED_TENDON),
    "equalities": ("", '<equality><joint joint1="pan" polycoef="0.05 0 0 0 0"/></equality>'),
}

CONTACT = """
<mujoco>
  <option gravity="0 0 0" o_solref="-1e8 0"><flag override="FLAG"/></option>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" condim="1"/>
    <body pos="0 0 0.2">
      <joint type="slide" axis="0 0 1" damping="0.1"/><geom name="ball" size="0.1" condim="1" KIND/>
    </body>
  </worldbody>
  MORE
</mujoco>
"""


def arm(kind: str) -> mujoco.MjModel:
    within, more = CONSTRAINTS[kind]
    return mujoco.MjModel.from_xml_string(ARM.replace("RANGE", within).replace("MORE", more))


@pytest.mark.parametrize("kind", CONSTRAINTS)
def test_a_constraint_suits_the_pose_in_which_it_moves_least_inertia(kind):
    """There, its frequency times the step is 1, and the limit of stability is 2."""
    model = arm(kind)
    with pytest.warns(UserWarning, match=f"softened.*: {kind}"):
        langevin = mm.Langevin(model, kT=0.2)
    longest = []
    for lift in np.linspace(-np.pi, np.pi, 41):
        data = mujoco.MjData(model)
        data.qpos[:] = 0.1, lift
        longest.append(langevin.largest_timestep(data))
    assert min(longest) == pytest.approx(2 * STEP, rel=0.1)


def test_an_arm_that_folds_over_its_limited_axis_keeps_its_temperature():
    """Kinetic temperatures, the virial beyond the limit, and how often the arm is folded.

    The virial is (-e f - kT) where the excess e is positive, and 0 elsewhere; its mean is 0.
    16 replicas of 40 s after 20 s; each of four z scores exceeds 4.5 at most once in 2000 seeds,
    by Student's distribution for 15 degrees of freedom.
    """
    model = arm("joint limits")
    model.opt.gravity[:] = 0
    with pytest.warns(UserWarning, match="softened"):
        langevin = mm.Langevin(model, kT=0.2)
    run = langevin.sample(
        20_000 * langevin.timestep,
        replicas=16,
        record_interval=20,
        burn_in=10_000 * langevin.timestep,
    )
    found = mm.kinetic_temperature(model, run)
    assert (abs(found.temperature - 0.2) < 4.5 * found.error).all()  # errors: 2.5 and 7 %
    data, virial = mujoco.MjData(model), np.zeros(run.qpos.shape[:2])
    excess = abs(run.qpos.values[..., 0]) - model.jnt_range[0, 1]
    for at in zip(*np.nonzero(excess > 0), strict=True):
        data.qpos[:] = run.qpos.values[at]
        virial[at] = excess[at] * abs(langevin.forces(data)[0]) - 0.2
    folded = np.cos(run.qpos.values[..., 1]) ** 2
    # Standard errors: 6 % of kT, for the fifth of the time that is spent beyond; and 0.015.
    for values, truth in ((virial, 0.0), (folded, mean_square_of_the_cosine(model))):
        means = values.mean(axis=1)
        assert abs(means.mean() - truth) < 4.5 * means.std(ddof=1) / 4


def mean_square_of_the_cosine(model: mujoco.MjModel) -> float:
    """Mean of cos^2(lift) over the law sqrt(det M), since no force acts on the lift."""
    data, matrix = mujoco.MjData(model), np.empty((2, 2))
    lifts = np.linspace(0, np.pi, 500, endpoint=False)
    weights = []
    for data.qpos[1] in lifts:
        mujoco.mj_forward(model, data)
        for row, unit in zip(matrix, np.eye(2), strict=True):
            mujoco.mj_mulM(model, data, row, unit)
        weights.append(np.sqrt(np.linalg.det(matrix)))
    return float(np.average(np.cos(lifts) ** 2, weights=weights))


@pytest.mark.parametrize("kind", ["", 'contype="0" conaffinity="0"'], ids=["geoms", "pair"])
def test_contacts_whose_parameters_are_overridden_are_refused(kind):
    pair = '<contact><pair geom1="floor" geom2="ball" condim="1"/></contact>' if kind else ""
    xml = CONTACT.replace("KIND", kind).replace("MORE", pair)
    model = mujoco.MjModel.from_xml_string(xml.replace("FLAG", "enable"))
    with pytest.raises(mm.InputError):
        mm.Langevin(model, kT=0.2)
    mm.Langevin(model, kT=0.2, disable=["contact"])
    mm.Langevin(mujoco.MjModel.from_xml_string(xml.replace("FLAG", "disable")), kT=0.2)


@pytest.mark.parametrize(
    ("flag", "whose"), [("diagexact", "of constraints"), ("speculative", "of contacts")]
)
def test_flags_without_a_potential_are_refused(flag, whose):
    """For a reason that no table has, since not every version of MuJoCo has these flags."""
    bit = getattr(mujoco.mjtEnableBit, f"mjENBL_{flag.upper()}", None)
    if bit is None:
        pytest.skip(f"MuJoCo {mujoco.__version__} has no flag {flag}")
    xml = CONTACT.replace("KIND", "").replace("MORE", "").replace("FLAG", "disable")
    model = mujoco.MjModel.from_xml_string(xml)
    mm.Langevin(model, kT=0.2)
    model.opt.enableflags |= int(bit)
    with refused(f"flag {flag}") as caught:
        mm.Langevin(model, kT=0.2)
    assert f"since the forces {whose}" in str(caught.value)


@pytest.mark.parametrize(
    ("shape", "number"),
    [
        ('type="sphere" size="0.1"', 1),
        ('type="capsule" size="0.1 0.2" quat="1 0 1 0"', 2),
        ('type="box" size="0.1 0.1 0.1"', 4),
    ],
)
def test_each_contact_of_one_body_adds_to_the_stiffness(shape, number):
    """As many as MuJoCo makes when the body lies on the floor: softer by the root of that."""
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco>
          <option gravity="0 0 0" timestep="{STEP}"/>
          <default><geom condim="1" solref="0.001 1"/></default>
          <worldbody>
            <geom type="plane" size="1 1 1"/>
            <body pos="0 0 0.0999">
              <joint type="slide" axis="0 0 1" damping="0.1"/><geom {shape} mass="1"/>
            </body>
          </worldbody>
        </mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == number
    with pytest.warns(UserWarning, match="softened"):
        langevin = mm.Langevin(model, kT=0.2)
    constant, impedance = langevin.effective_model.geom_solref[1, 0], model.geom_solimp[1, 1]
    frequency = 1 / (constant * np.sqrt(1 - impedance))
    product = STEP * np.sqrt(number) * frequency
    assert product == pytest.approx(0.5, rel=1e-9)
