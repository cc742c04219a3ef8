"""Dipoles with hysteresis: loops by a minimum of energy, loss per cycle, energy and forces.

The judge knows no play: it finds the moment that minimizes the energy in the field, what the dipole
stores, and the heat of the change (`minimum`).
"""

import math

import mujoco
import numpy as np
import pytest
from energy_slopes import forces_by_energy
from rods import (
    B_C,
    B_K,
    CURRENT,
    DRIVEN,
    EARTH,
    LOCKED,
    MOMENT,
    MU0,
    REMANENCE,
    SATELLITE,
    loaded,
)  # fmt: skip
from scipy.optimize import brentq, minimize_scalar

import magmotor as mm


def moment_of(play):
    return MOMENT * play / np.hypot(play, B_K)


def stored(moment):
    return MOMENT * B_K * (1 - math.sqrt(1 - (moment / MOMENT) ** 2))


def minimum(field, before):
    """The moment of least energy in a field, after another moment."""

    def energy(moment):
        return stored(moment) - field * moment + B_C * abs(moment - before)

    parts = [(-MOMENT, before), (before, MOMENT)]
    found = [
        minimize_scalar(energy, bounds=part, method="bounded", options={"xatol": 1e-13})
        for part in parts
    ]
    return min([*(each.x for each in found), before], key=energy)


def driven(fields):
    """The moments of a fixed rod whose field is stepped through values, by its torque across."""
    model, data = loaded(LOCKED, more=DRIVEN, field="1 0 0", actuators=CURRENT)
    moments = []
    for data.ctrl[0] in fields:
        mujoco.mj_step(model, data)
        moments.append(data.qfrc_passive[0] / 1e-5)
    return np.array(moments)


def test_major_and_minor_loops_are_minima_of_energy():
    """Random turning points, of steps far beyond the coercivity, and small ones."""
    fields = np.random.default_rng(5).normal(size=300) * np.repeat([3e-4, 4e-5, 1e-5], 100)
    expected, moment = [], 0.0
    for field in fields:
        moment = minimum(field, moment)
        expected.append(moment)
    assert abs(driven(fields) - expected).max() < 1e-7 * MOMENT  # 1e-8


def test_the_major_loop_has_the_numbers_that_are_given():
    up = np.linspace(-1.0, 1.0, 2001)  # T, far beyond saturation
    moments = driven([*up, *up[::-1], 0.0, B_C])
    assert moments[2000] == pytest.approx(MOMENT, rel=1e-8, abs=0)
    assert moments[-2] == pytest.approx(-REMANENCE * MOMENT, rel=1e-12, abs=0)
    assert abs(moments[-1]) < 1e-15 * MOMENT


@pytest.mark.parametrize("amplitude", [1.5 * B_C, 5 * B_C, 1e4 * B_C])
def test_a_cycle_loses_the_area_of_its_loop(amplitude):
    """In strong fields, four times the coercivity and the moment at saturation."""
    angle = np.linspace(0, 4 * math.pi, 200_001)
    fields = amplitude * np.sin(angle)
    moments = driven(fields)[100_000:]
    loss = -np.trapezoid(moments, fields[100_000:])
    exact = 4 * B_C * moment_of(amplitude - B_C)
    assert loss == pytest.approx(exact, rel=1e-8, abs=0)  # 9e-10
    if amplitude > 1e3 * B_C:
        assert exact == pytest.approx(4 * B_C * MOMENT, rel=1e-6, abs=0)


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_a_satellite_loses_its_spin_to_a_torque_that_no_speed_changes(speed):
    """J dw/dt is minus the loss per turn over 2 pi."""
    turns, inertia = 3, 1 / 6 * 0.1**2
    model, data = loaded(timestep=2 * math.pi / speed / 1000)
    data.qvel[0] = speed
    mujoco.mj_step(model, data, nstep=1000)  # on the loop
    before = data.qvel[0]
    mujoco.mj_step(model, data, nstep=1000 * turns)
    torque = inertia * (data.qvel[0] - before) / (2 * math.pi * turns / speed)
    exact = -4 * B_C * moment_of(EARTH - B_C) / (2 * math.pi)
    assert torque == pytest.approx(exact, rel=1e-3, abs=0)  # 1e-4


def heat_of(before, after):
    return B_C * float(np.abs(moment_of(after) - moment_of(before)).sum())


def test_what_motion_loses_is_heat():
    """To the order of RK4, except where the play begins and ends to move."""
    lost = []
    for timestep in (0.5, 0.25):
        model, data = loaded(timestep=timestep)
        data.qvel[0], heat = 0.1, 0.0
        total = []
        for _ in range(round(40 / timestep)):
            mujoco.mj_forward(model, data)
            before, now = data.plugin_state[0], data.plugin_state[1]
            heat += heat_of(before, now)
            kinetic = 0.5 / 6 * 0.1**2 * data.qvel[0] ** 2
            total.append(kinetic + mm.magnetic_energy(model, data) + heat)
            mujoco.mj_step(model, data)
            assert data.plugin_state[0] == now  # whatever the stages of RK4 have seen
        lost.append(np.ptp(total))
        assert heat > 1e-8
    assert lost[0] < 1e-3 * heat  # 8e-5
    assert lost[1] < lost[0] / 3


BAR = '<site pos=".03 0 .01" zaxis="1 0 1" user=".3"/>'


def test_a_rod_feels_the_magnets_of_its_own_body():
    """And fields that are fixed to it, but no other rods; the energy has them, too."""
    twin = '<site name="twin" pos="0 .001 0" zaxis="1 0 0" user="1"/>'
    bar = '<site pos=".1 0 0" zaxis="1 0 0" user=".5"/></body>'
    bodies = SATELLITE.replace("<site", f"{twin}<site").replace("</body>", bar)
    fixed = """
    <numeric name="field_of_coil" data="2e-5 0 0"/>
    <tuple name="field"><element objtype="numeric" objname="field_of_coil"/>
      <element objtype="body" objname="satellite"/></tuple>"""
    model, data = loaded(bodies, ("rod", "twin"), field="0 0 1e-5", more=fixed)
    mujoco.mj_forward(model, data)
    own = MU0 * 0.5 / (2 * math.pi * 0.1**3) + 2e-5
    play = own - B_C
    assert data.plugin_state[3] == pytest.approx(play, rel=5e-11, abs=0)  # 2e-12
    moment = moment_of(play)
    model.site_user[0] = 0.0
    energy = stored(moment) - moment * own
    assert mm.magnetic_energy(model, data) == pytest.approx(energy, rel=5e-11, abs=0)
    assert not data.qfrc_passive.any()


def test_a_rod_feels_a_magnet_by_its_geom_on_its_own_body():
    """The field of a sphere is that of a dipole: m = J V/mu0."""
    ball = '<geom size=".01" pos=".1 0 0" mass="0" user="0.3 0 0"/></body>'
    bodies, words = SATELLITE.replace("</body>", ball), "dipoles fields hysteresis magnets"
    model, data = loaded(bodies, field="0 0 1e-5", act=words)
    mujoco.mj_forward(model, data)
    play = 0.3 * 4 / 3 * math.pi * 0.01**3 / (2 * math.pi * 0.1**3) - B_C
    assert data.plugin_state[1] == pytest.approx(play, rel=5e-11, abs=0)  # 1e-15


def crowd():
    """Two rods on free bodies, a magnet of true shape and a dipole that moves, in a gradient."""
    free = (
        '<body pos="{}" quat="{}"><freejoint/><geom size=".004" contype="0" mass=".01"/>{}</body>'
    )
    rod = '<site name="{}" pos=".002 .001 0" zaxis="{}" user="{}"/>'
    disk = '<geom type="cylinder" size=".01 .003" user="0 .1 1.2" contype="0" mass=".01"/>'
    rods = rod.format("rod", "1 2 0", MOMENT) + rod.format("more", "1 2 0", 2e-3)
    return "".join((
        free.format("0 0 0", "1 .2 .3 .1", rods + BAR),
        free.format(".02 .01 .015", ".2 1 .3 .1", rod.format("other", "-1 -2 0", MOMENT)),
        free.format(".01 -.02 .02", "1 0 .3 .1", disk),
        free.format("-.03 .01 .02", "1 0 .3 .1", '<site user="1e-3"/>'),
    ))  # fmt: skip


def test_forces_are_the_derivatives_of_the_least_energy():
    """Of the energy, and of the heat that a change from what the rods remember would be."""
    model, data = loaded(
        crowd(), ("rod", "more", "other"), act="dipoles fields magnets hysteresis",
        field="1e-5 2e-5 0 1e-3 0 2e-3 0 0", loop="2000 0.3",
    )  # fmt: skip
    coercivity, knee = MU0 * 2000, MU0 * 2000 * math.sqrt(1 / 0.09 - 1)
    sites = np.array([0, 1, 3])
    saturation = np.abs(model.site_user[sites, 0])
    data.plugin_state[2 * sites] = before = np.array([1e-3, -2e-3, 3e-3])

    def energy(model, data):
        mujoco.mj_forward(model, data)
        moments = [
            saturation * g / np.hypot(g, knee) for g in (before, data.plugin_state[2 * sites + 1])
        ]
        return mm.magnetic_energy(model, data) + coercivity * np.abs(moments[1] - moments[0]).sum()

    mujoco.mj_forward(model, data)
    found = forces_by_energy(model, data, 1e-6, energy)
    assert (data.plugin_state[2 * sites + 1] != before).all()
    assert abs(found - data.qfrc_passive).max() < 1e-6 * abs(found).max()


def in_line(distance):
    """Two rods on one line, each on a body of its own, and the field of one at saturation."""
    body = '<body name="{0}" pos="{0} 0 0"><freejoint/><geom size=".004" contype="0"/>{1}</body>'
    rod = '<site name="{}" zaxis="1 0 0" user="{}"/>'
    bodies = body.format(0, rod.format("rod", MOMENT))
    bodies += body.format(distance, rod.format("other", MOMENT))
    return bodies, MU0 / (2 * math.pi) * MOMENT / distance**3


def test_rods_magnetize_each_other():
    distance = 0.03
    bodies, mutual = in_line(distance)
    model, data = loaded(bodies, ("rod", "other"))
    mujoco.mj_forward(model, data)
    gap = lambda play: EARTH - B_C + mutual * moment_of(play) / MOMENT - play  # noqa: E731
    play = brentq(gap, 0, 1, xtol=1e-18, rtol=1e-14)
    assert play > 1.1 * (EARTH - B_C)
    assert data.plugin_state[1::2] == pytest.approx([play, play], rel=1e-11, abs=0)
    force = 3 * MU0 * moment_of(play) ** 2 / (2 * math.pi * distance**4)
    assert data.qfrc_passive[0] == pytest.approx(force, rel=1e-10, abs=0)
    apart, data = loaded(bodies, ("rod", "other"), more=COUPLING, act="all")
    mujoco.mj_forward(apart, data)
    assert data.plugin_state[1] == EARTH - B_C


COUPLING = """
<tuple name="coupling"><element objtype="body" objname="0"/>
  <element objtype="body" objname="0.03"/></tuple>"""


def test_moments_that_do_not_settle_are_an_error():
    """Where each rod is on the brink of magnetizing the other one without a field."""
    distance = (MU0 / (2 * math.pi) * MOMENT / B_K) ** (1 / 3)
    bodies, mutual = in_line(distance)
    assert mutual == pytest.approx(B_K, rel=1e-12, abs=0)
    with pytest.raises(ValueError, match="site 1 'other' is too near another one"):
        loaded(bodies, ("rod", "other"), field=f"{B_C * (1 + 1e-9)!r} 0 0")
