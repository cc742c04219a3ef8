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
<default><geom solimp="0.9 0.95 {}"/></default>
<custom><text name="magmotor" data="dipoles"/></custom><worldbody>{}</worldbody></mujoco>"""

STARTS = {1: 60, 1.5: 80, 5: 190}
"""Distances at the start over that at touch, and durations over T."""

PAGE = Path(__file__).parents[2] / "docs" / "contact.md"
ROWS = re.findall(r"^\| ([\d.]+) \|(.*)\|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def balls(softness, start, steps, width=1e-3):
    """Two balls `start` times the distance at touch apart; `softness` is s/T, the timestep s/steps.

    `width` is that of the impedance in m, which balls of another size have in other units.
    """
    constant = softness * TIME
    places = 0, start * 2 * RADIUS
    bodies = "".join(BALL.format(z, RADIUS, DENSITY, constant, MOMENT) for z in places)
    return mujoco.MjModel.from_xml_string(MODEL.format(constant / steps, width, bodies))


def meet(softness, start, steps, width=1e-3, duration=None):
    """Penetrations at rest and at most in percent of the radius; None if the balls fly apart."""
    model = balls(softness, start, steps, width)
    data, apart = mujoco.MjData(model), []
    while data.time < (duration or STARTS[start]) * TIME:
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


def said(softness, steps, width=1e-3):
    """What `check` says: the two numbers, "may", "will" (fly apart), or "holds"."""
    findings = str(mm.check(balls(softness, 1, steps, width)))
    numbers = re.search(r"by ([\d.]+) % of their radius at rest, and by up to (\d+) %", findings)
    if numbers:
        return ", ".join(numbers.groups())
    return next((word for word in ("may", "will") if f" {word} fly apart" in findings), "holds")


def test_the_table_has_its_rows():
    assert [row[0] for row in ROWS] == [
        f"{x:g}" for x in (0.15, 0.3, 0.6, 0.9, 1, 1.1, 1.2, 1.3, 1.5)
    ]


@pytest.mark.parametrize(("softness", "entries"), ROWS)
def test_the_table_of_penetrations(softness, entries):
    """What `check` says of a row holds in it."""
    cases = [(start, steps) for start in STARTS for steps in (10, 2)]
    *entries, often, seldom = (entry.strip() for entry in entries.split("|"))
    says = {10: often, 2: seldom}
    with mm.magnetism():
        for entry, (start, steps) in zip(entries, cases, strict=True):
            found = meet(float(softness), start, steps)
            if entry == "flies apart":
                assert found is None
                assert says[steps] in {"may", "will"}
            else:
                at_rest, most = map(float, entry.split(","))
                assert found
                assert found[0] == pytest.approx(at_rest, abs=0.051)  # one digit
                assert found[1] == pytest.approx(most, abs=0.51)
                if "," in says[steps]:
                    rest, bound = map(float, says[steps].split(","))
                    assert found[0] < rest + 0.5  # two digits
                    assert found[1] < bound
    for steps, text in says.items():
        assert said(float(softness), steps) == text


GAPS = np.random.default_rng(0).uniform(0.15, 2.5, 42)
"""Distances of surfaces at the start, over that at touch."""


@pytest.mark.parametrize("radius", [1e-3, 5e-3, 20e-3])
@pytest.mark.parametrize("steps", [2, 10])
@pytest.mark.parametrize("softness", [0.45, 0.7, 0.85, 1.03])
def test_no_start_is_worse_than_what_is_said(softness, steps, radius):
    """Where `check` says that balls will stick, all do, and no deeper."""
    width = 1e-3 * RADIUS / radius
    says = said(softness, steps, width)
    assert (says in {"may", "will"}) == (softness > 1)
    if softness < 1:
        bound, most = float(says.split(",")[1]), []
        with mm.magnetism():
            for gap in GAPS if radius == 5e-3 else GAPS[::3]:
                duration = 10 + 6 * (1 + 2 * gap) ** 2.5
                found = meet(softness, 1 + gap, steps, width, duration)
                assert found
                most.append(found[1])
        assert 0.6 * bound < max(most) < bound  # 0.66 .. 0.98


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
