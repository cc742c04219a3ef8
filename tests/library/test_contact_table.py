"""The table "Measured" of docs/contact.md: two balls, and how stiff their contact is."""

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

import magmotor as mm

pytestmark = pytest.mark.filterwarnings("ignore:.*mm.check.model. proposes:UserWarning")

MU0 = 4e-7 * np.pi
RADIUS, DENSITY, REMANENCE = 5e-3, 7500.0, 1.45
MASS = DENSITY * 4 / 3 * np.pi * RADIUS**3
MOMENT = REMANENCE * 4 / 3 * np.pi * RADIUS**3 / MU0
FORCE = 3 * MU0 * MOMENT**2 / (2 * np.pi * (2 * RADIUS) ** 4)
TIME = np.sqrt(2 * RADIUS * MASS / 2 / FORCE)
"""T of two balls that touch."""

BALL = """<body pos="0 0 {}"><freejoint/>
<geom size="{}" density="{}" solref="{} 1"/><site user="{}"/></body>"""
MODEL = """<mujoco><option gravity="0 0 0" timestep="{}"/>
<custom><text name="magmotor" data="dipoles"/></custom><worldbody>{}</worldbody></mujoco>"""

STARTS = {1: 60, 1.5: 80, 5: 190}
"""Distances at the start over that at touch, and durations over T."""

PAGE = Path(__file__).parents[2] / "docs" / "contact.md"
ROWS = re.findall(r"^\| ([\d.]+) \|(.*)\|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def meet(softness, start, steps):
    """Penetrations at rest and at most in percent of the radius; None if the balls fly apart.

    `softness` is s/T, and the timestep is s/steps.
    """
    constant = softness * TIME
    places = 0, start * 2 * RADIUS
    bodies = "".join(BALL.format(z, RADIUS, DENSITY, constant, MOMENT) for z in places)
    model = mujoco.MjModel.from_xml_string(MODEL.format(constant / steps, bodies))
    data, apart = mujoco.MjData(model), []
    while data.time < STARTS[start] * TIME:
        try:
            mujoco.mj_step(model, data)
        except mujoco.FatalError as error:
            if "coincide" not in str(error):
                raise
            return None
        apart.append(float(np.linalg.norm(data.xpos[2] - data.xpos[1])) / RADIUS)
        if not 0.3 < apart[-1] < 2 * start + 6:
            return None
    return 100 * (2 - apart[-1]), 100 * (2 - min(apart))


def test_the_table_has_its_rows():
    assert [row[0] for row in ROWS] == [
        f"{x:g}" for x in (0.15, 0.3, 0.6, 0.9, 1, 1.1, 1.2, 1.3, 1.5)
    ]


@pytest.mark.parametrize(("softness", "entries"), ROWS)
def test_the_table_of_penetrations(softness, entries):
    cases = [(start, steps) for start in STARTS for steps in (10, 2)]
    with mm.magnetism():
        for entry, case in zip(entries.split("|"), cases, strict=True):
            found = meet(float(softness), *case)
            if "flies apart" in entry:
                assert found is None
            else:
                at_rest, most = map(float, entry.split(","))
                assert found
                assert found[0] == pytest.approx(at_rest, abs=0.051)  # one digit
                assert found[1] == pytest.approx(most, abs=0.51)


def compliance(penetration):
    """C in the formula of the page, with MuJoCo's default solimp = 0.9 0.95 1 mm 0.5 2."""
    x = min(penetration / 1e-3, 1)
    impedance = 0.9 + 0.05 * (2 * x**2 if x < 0.5 else 1 - 2 * (1 - x) ** 2)
    return 0.95**2 * (1 - impedance) / impedance**2


def lack(x, softness):
    """How much the push exceeds the pull at x = r/d."""
    return x * (1 - x) ** 4 - compliance(x * 2 * RADIUS) * softness**2


@pytest.mark.parametrize("softness", [0.15, 0.3, 0.6, 0.9, 1.2])
def test_the_penetration_at_rest_is_that_of_the_formula(softness):
    x = brentq(lack, 0, 0.2, args=(softness,))
    with mm.magnetism():
        found = meet(softness, 1, 10)
    assert found
    assert found[0] == pytest.approx(200 * x, rel=5e-6)  # 3e-7


@pytest.mark.parametrize(("softness", "holds"), [(1.25, True), (1.31, False)])
def test_beyond_the_limit_no_contact_holds(softness, holds):
    """The limit is 1.28 T."""
    assert (max(lack(x, softness) for x in np.linspace(0, 1, 1000)) > 0) == holds
    with mm.magnetism():
        assert (meet(softness, 1, 10) is not None) == holds
