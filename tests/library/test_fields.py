"""Applied fields: closed forms, tables, frames, and bad input."""

import math
import re

import magpylib
import mujoco
import numpy as np
import pytest
from energy_slopes import slope_of_energy
from refusals import misdeclared, refused

import magmotor as mm
from magmotor.numerics.cubic_convolution import interpolate

MODEL = """
<mujoco>
  <option gravity="0 0 0" timestep="1e-3" integrator="RK4"/>
  <custom>
    <text name="magmotor" data="dipoles fields"/>
    {custom}
  </custom>
  <worldbody>{bodies}</worldbody>
</mujoco>
"""
NEEDLE = (
    '<body name="needle" pos="{pos}"><freejoint/><geom size="0.01"/>'
    '<site name="dipole" zaxis="{axis}" user="0.5"/></body>'
)


def numeric(numbers, name="field"):
    return f'<numeric name="{name}" data="{" ".join(map(repr, map(float, np.ravel(numbers))))}"/>'


def model_with(*custom, bodies="", pos="0.1 0.2 0.3", axis="1 2 -2"):
    return mujoco.MjModel.from_xml_string(
        MODEL.format(custom="".join(custom), bodies=NEEDLE.format(pos=pos, axis=axis) + bodies)
    )


def wrench(model, body="needle"):
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return data.xfrc_applied[model.body(body).id]


def test_a_uniform_field_turns_and_does_not_push():
    moment = 0.5 * np.array([1, 2, -2]) / 3
    found = wrench(model_with(numeric([0.3, -0.1, 0.2])))
    np.testing.assert_array_equal(found[:3], 0)
    np.testing.assert_allclose(found[3:], np.cross(moment, [0.3, -0.1, 0.2]), rtol=1e-15)  # 0


def test_a_needle_swings_in_the_field_at_its_frequency():
    """omega^2 = m B/I for small angles; the period grows by 1 + theta^2/16."""
    model = model_with(numeric([0, 0, 0.02]), pos="0 0 0", axis="0.02 0 1")
    data = mujoco.MjData(model)
    omega = math.sqrt(0.5 * 0.02 / model.body("needle").inertia[0]) * (1 - 0.02**2 / 16)
    model.opt.timestep = math.pi / omega / 50  # 100 steps a period
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=1000)
    angle = math.atan2(*data.site("dipole").xmat[[2, 8]])
    assert angle == pytest.approx(math.atan(0.02), rel=5e-5)  # 2e-6


def test_a_gradient_pulls():
    """F_j = m_i G_ij, torque m x (B + G x), with G symmetric and without trace."""
    flux, (xx, xy, xz, yy, yz) = np.array([0.1, 0.2, 0.3]), (2.0, -1.0, 0.5, 3.0, 0.7)
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, -xx - yy]])
    moment, place = 0.5 * np.array([1, 2, -2]) / 3, np.array([0.1, 0.2, 0.3])
    found = wrench(model_with(numeric([*flux, xx, xy, xz, yy, yz])))
    np.testing.assert_allclose(found[:3], matrix @ moment, rtol=1e-15)  # 0
    np.testing.assert_allclose(found[3:], np.cross(moment, flux + matrix @ place), rtol=1e-15)  # 0


COIL = magpylib.current.Circle(diameter=0.4, current=1000.0, position=(0.05, 0, -0.3))
LOWER, UPPER = np.array([-0.1, -0.05, 0.0]), np.array([0.15, 0.2, 0.3])


def test_a_table_approaches_the_field_that_it_samples():
    """Errors of the field of a current loop: third order for B, second order for its derivatives.

    The divergence and the curl, which vanish in the field of the loop, vanish to second order.
    """
    points = LOWER + (UPPER - LOWER) * np.random.default_rng(2).random((40, 3))
    exact, errors, sources = COIL.getB(points), [], []
    for count in (12, 23):  # half the spacing
        text = mm.tabulated_field(COIL.getB, LOWER, UPPER, (count, count, count))
        model = mujoco.MjModel.from_xml_string(MODEL.format(custom=text, bodies=""))
        data = mujoco.MjData(model)
        errors.append(np.sqrt(np.mean((mm.field(model, data, points) - exact) ** 2)))
        step = 1e-6
        jacobian = np.stack(
            [
                (mm.field(model, data, points + e) - mm.field(model, data, points - e)) / (2 * step)
                for e in step * np.eye(3)
            ],
            axis=-1,
        )
        curl = jacobian - np.swapaxes(jacobian, 1, 2)
        trace = np.trace(jacobian, axis1=1, axis2=2)
        sources.append(np.sqrt(np.mean(curl**2) + np.mean(trace**2)))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(3, abs=0.6)  # 0.46
    assert math.log2(sources[0] / sources[1]) == pytest.approx(2, abs=0.5)  # 0.07
    assert errors[1] < 1e-4 * np.abs(exact).max()  # 8e-6


def test_a_table_conserves_energy_in_spite_of_its_sources():
    """A coarse table, in which B has divergence and curl; RK4 at half the step gives 1/16 or less.

    The interpolant's second derivatives jump, so that the order is between three and four.
    """
    text = mm.tabulated_field(COIL.getB, LOWER, UPPER, (4, 4, 4))
    model = model_with(text, pos="0 0.05 0.12", axis="1 0 3")
    drifts = []
    for steps in (400, 800):
        data = mujoco.MjData(model)
        model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        model.opt.timestep = 1.0 / steps
        energies, kinetic = [], []
        with mm.magnetism():
            for _ in range(steps):
                mujoco.mj_forward(model, data)
                kinetic.append(data.energy[1])
                energies.append(data.energy[1] + mm.magnetic_energy(model, data))
                mujoco.mj_step(model, data)
        drifts.append(np.ptp(energies))
    assert np.ptp(energies) < 1e-7 * np.ptp(kinetic)  # 4e-9
    assert drifts[0] > 5 * drifts[1]  # 33


def test_a_field_moves_with_its_body_and_feels_the_reaction():
    """Two free bodies, one of which carries a field: both wrenches cancel about any point."""
    carrier = (
        '<body name="carrier" pos="-0.2 0.1 0" euler="20 30 40"><freejoint/><geom size="0.05"/>'
        '<site user="0.3"/></body>'
    )
    place = (
        '<tuple name="field of the carrier"><element objtype="numeric" objname="field"/>'
        '<element objtype="body" objname="carrier"/></tuple>'
    )
    model = model_with(numeric([0.1, 0.2, 0.3, 2, -1, 0.5, 3, 0.7]), place, bodies=carrier)
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    forces, torques = data.xfrc_applied[:, :3], data.xfrc_applied[:, 3:]
    total = (torques + np.cross(data.xipos, forces)).sum(axis=0)
    assert np.linalg.norm(forces[1]) > 0.1
    np.testing.assert_allclose(forces.sum(axis=0), 0, rtol=0, atol=1e-15)  # 0
    np.testing.assert_allclose(total, 0, rtol=0, atol=1e-15)  # 6e-17


def test_a_dipole_outside_of_the_table_is_an_error():
    text = mm.tabulated_field(COIL.getB, LOWER, UPPER, (5, 5, 5))
    model = model_with(text, pos="0.2 0 0.1")
    data = mujoco.MjData(model)
    with pytest.raises(mujoco.FatalError) as in_a_step, mm.magnetism():
        mujoco.mj_forward(model, data)
    with misdeclared("outside", model.site("dipole").id) as outside:
        mm.magnetic_energy(model, data)
    assert str(in_a_step.value) == str(outside.value)
    with refused("points"):
        mm.field(model, data, [0, 0, 9])


def test_the_corners_of_a_table_are_inside():
    """Of these 2000 grids, 300 to 800 had a last node that counted as outside, by rounding."""
    rng = np.random.default_rng(8)
    for counts in rng.integers(4, 12, (2000, 3)):
        low = rng.uniform(-1, 1, 3)
        high = low + rng.uniform(0.01, 1, 3)
        spacing = (high - low) / (counts - 1)
        nodes = rng.normal(size=(*counts, 3))
        for corner, node in ((low, nodes[0, 0, 0]), (high, nodes[-1, -1, -1])):
            place = tuple((corner - low) * (1 / spacing))
            found = interpolate(place, tuple(counts.tolist()), nodes.ravel())
            assert np.abs(found[:3] - node).max() < 3e-14  # 4e-15
    assert np.isnan(interpolate((0.0, 3 + 1e-5, 0.0), (4, 4, 4), np.zeros(192))).all()


def test_a_node_that_is_not_finite_is_not_taken_for_the_outside():
    """Nodes are checked while a model is loaded; this one is changed afterwards."""
    place = (
        '<tuple name="field"><element objtype="numeric" objname="field"/>'
        '<element objtype="site" objname="frame"/></tuple>'
    )
    frame = '<site name="frame" pos="0 0 0.1" zaxis="1 0 0"/>'
    text = mm.tabulated_field(COIL.getB, LOWER, UPPER, (5, 5, 5))
    model = model_with(text, place, bodies=frame, pos="0.15 0 0.1")
    model.numeric("field").data[9:] = math.nan
    data = mujoco.MjData(model)
    with pytest.raises(mujoco.FatalError) as caught, mm.magnetism():
        mujoco.mj_forward(model, data)
    said = str(caught.value)
    assert "dipole site 1 'dipole' is at a node that is not finite" in said
    assert re.findall(r"it is at \(.*, (\S+)\) m in the frame", said) == ["0.15"]


def test_the_energy_is_defined_where_the_forces_are():
    """Dipoles outside of a table that does not act on them: fixed to them, or neither moves."""
    text = mm.tabulated_field(COIL.getB, LOWER, UPPER, (5, 5, 5))
    far = '<site pos="0 0 7" user="3"/>'
    carrier = (
        '<body name="carrier" pos="0 0 0.3"><freejoint/><geom size="0.01"/>'
        '<site pos="0 0 5" user="0.1"/></body>'
    )
    place = (
        '<tuple name="field"><element objtype="numeric" objname="field"/>'
        '<element objtype="body" objname="carrier"/></tuple>'
    )
    for parts, bodies in (((text,), far), ((text, place), carrier)):
        model = model_with(*parts, bodies=bodies, pos="0 0.05 0.4" if place in parts else "0 0 0.1")
        data = mujoco.MjData(model)
        with mm.magnetism():
            mujoco.mj_forward(model, data)
        force = data.xfrc_applied[1, 2]
        slope = slope_of_energy(model, data, np.eye(model.nv)[2], 1e-6)
        assert force == pytest.approx(-slope, rel=2e-10)  # 7e-12


def test_describe_names_fields(capsys):
    place = (
        '<tuple name="field"><element objtype="numeric" objname="field_b"/>'
        '<element objtype="site" objname="dipole"/></tuple>'
    )
    text = mm.tabulated_field(COIL.getB, LOWER, UPPER, (4, 5, 6), name="field_c")
    parts = numeric([1, 2, 3]), numeric(np.ones(8), "field_b"), text
    found = mm.describe(model_with(*parts, place))
    print(found)
    assert found.acting == ("dipoles", "fields")
    assert found.fields == {
        "field": "uniform",
        "field_b": "gradient, fixed to dipole",
        "field_c": "table of 4 x 5 x 6 nodes",
    }
    assert "fields: field (uniform), field_b (gradient, fixed to dipole)" in capsys.readouterr().out


@pytest.mark.slow
def test_a_needle_at_a_temperature_obeys_langevins_law():
    """<cos> = coth a - 1/a with a = m B/kT, for a field that a control doubles.

    The standard error, 0.022, comes from 64 independent replicas; at 5 of them, the false-alarm
    rate is 5e-6 by Student's t. Without the drive, the mean would be 10 of them lower, which is
    seen in all but 3e-6 of seeds.
    """
    bodies = (
        '<body><joint type="ball" damping="1e-6"/><geom size="0.01"/>'
        '<site name="needle" user="0.5"/></body>'
    )
    group = (
        '<tuple name="field"><element objtype="numeric" objname="field"/>'
        '<element objtype="actuator" objname="drive"/></tuple>'
    )
    text = MODEL.format(custom=numeric([0, 0, 0.002]) + group, bodies=bodies).replace(
        "</worldbody>",
        '</worldbody><actuator><general name="drive" site="needle" gainprm="0"/></actuator>',
    )
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = 2e-3
    data = mujoco.MjData(model)
    data.ctrl[0] = 2.0
    run = mm.Langevin(model, kT=1e-3).sample(
        400 * model.opt.timestep, replicas=64, burn_in=300 * model.opt.timestep, initial=data
    )
    _, x, y, _ = np.moveaxis(run.qpos.values, -1, 0)
    cosines = (1 - 2 * (x**2 + y**2)).mean(axis=1)
    error = cosines.std(ddof=1) / 8
    a = 0.5 * 0.004 / 1e-3
    assert abs(cosines.mean() - (1 / math.tanh(a) - 1 / a)) < 5 * error  # 0.9
    assert cosines.mean() - (1 / math.tanh(a / 2) - 2 / a) > 5 * error  # 9
