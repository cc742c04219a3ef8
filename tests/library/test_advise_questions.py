"""What `mm.advise` cannot answer: bad input, rest, divergence, interruptions."""

import contextlib
import copy
import math
import warnings

import mujoco
import pytest
from advised_models import AMPLITUDE, BALL, NEEDLE, OSCILLATOR, PENDULUM, Clock, started
from refusals import refused

import magmotor as mm
from magmotor.advice import survey
from magmotor.advice.measure import Measurement
from magmotor.advice.paths import quiet
from magmotor.advice.survey import Survey


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """Budgets count steps instead of time, so that no load of the machine changes an answer."""
    return Clock(monkeypatch, step=1e-5)


@pytest.mark.parametrize("inside", [False, True])
def test_forces_that_do_not_act_during_the_measurement_are_noted(inside):
    start, end = NEEDLE.index("<extension>"), NEEDLE.index("</extension>")
    marked = NEEDLE[:start] + "<extension>" + NEEDLE[end:]
    with mm.magnetism() if inside else contextlib.nullcontext():
        advice = mm.advise(*started(marked, qvel=[1.0]), error=0.1, budget=2)
    noted = [note for note in advice.notes if "dipoles outside of magmotor.magnetism()" in note]
    assert len(noted) == (0 if inside else 1)


def test_what_is_not_finite_along_the_path_is_no_accuracy():
    def at_first(_, run):
        return run.qpos[0] if run.time < 1.0 else math.nan

    model, data = started(PENDULUM, [1.0, 0.5])
    with refused("quantity"):
        mm.advise(model, data, quantity=at_first, duration=2.0, budget=5)


def test_a_quantity_that_changes_only_when_chaos_has_set_in_has_no_error():
    def late(_, run):
        return run.qpos[1] if run.time > 15.0 else 0.0

    model, data = started(PENDULUM.replace('"0.005"', '"0.02"'), [2.5, 1.0])
    advice = mm.advise(model, data, quantity=late, duration=20.0, budget=6)
    assert advice.horizon == pytest.approx(15.0, abs=0.1)  # 0.01
    assert not advice.method
    assert advice.reason == "the quantity does not change before the reference is lost"
    assert advice.statistics


def test_copied_data_are_accepted():
    model, data = started(PENDULUM, [1.0, 0.5])
    assert mm.advise(model, copy.deepcopy(data), duration=0.3, budget=3).points


def test_warnings_are_heard_again_after_overlapping_blocks():
    before = mujoco.get_mju_user_warning()  # dm_control, if imported, has one of its own
    first, second = quiet(), quiet()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    second.__exit__(None, None, None)
    with pytest.warns(UserWarning, match="heard"):
        warnings.warn("heard", stacklevel=1)
    assert mujoco.get_mju_user_warning() is before


TOWER = """
<mujoco>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body pos="0 0 0.1"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
    <body name="upper" pos="0 0 0.3"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
    <body pos="2 0 2"><joint axis="0 1 0"/><geom pos="0 0 -1" size=".1"/></body>
  </worldbody>
  <sensor><framelinvel name="speed" objtype="xbody" objname="upper"/></sensor>
</mujoco>
"""


def settled(xml):
    model, data = started(xml)
    mujoco.mj_step(model, data, nstep=2500)
    return model, data


@pytest.mark.parametrize(("state", "quantity"), [
    (started(PENDULUM), "positions"), (started(PENDULUM, [1e-17]), "joint two"),
    (started(PENDULUM, [1e-17]), "energy"), (settled(BALL), "positions"),
    (settled(BALL), "energy"), (settled(TOWER), "positions"), (settled(TOWER), "sensor speed"),
])  # fmt: skip
def test_a_model_at_rest_is_named_before_anything_is_measured(state, quantity, monkeypatch):
    monkeypatch.delattr(Measurement, "reference")
    with refused("quantity"):
        mm.advise(*state, quantity=quantity)


def test_an_element_is_found_by_its_name_in_latin_1(tmp_path):
    path = tmp_path / "model.xml"
    path.write_bytes(PENDULUM.replace('"two"', '"zw\xf6lf"').encode("latin-1"))
    model = mujoco.MjModel.from_xml_path(str(path))
    with refused("quantity") as caught:
        mm.advise(model, quantity="joint zw\xf6lf")
    assert caught.value.value == "joint zw\xf6lf"


def test_something_at_rest_beside_something_that_moves_is_named():
    model, data = settled(TOWER)
    data.qpos[-1] = 0.1
    with refused("quantity") as caught:
        mm.advise(model, data, quantity="body upper", budget=2)
    assert "at rest" not in caught.value.allowed


@pytest.mark.parametrize("quantity", ["positions", "joint two", "energy"])
def test_slow_motion_is_judged(quantity):
    advice = mm.advise(*started(PENDULUM, [1e-3]), quantity=quantity, budget=5)
    assert advice.method
    assert advice.doubt < 1e-6  # 7e-8


@pytest.mark.parametrize(("timestep", "duration"), [("0.005", 1.0), ("0.04", 1.92)])
def test_the_duration_by_default_has_steps_enough(timestep, duration, monkeypatch):
    monkeypatch.setattr(Survey, "run", lambda _: None)
    advice = mm.advise(*started(PENDULUM.replace("0.005", timestep), [0.1]), budget=2)
    assert advice.duration == pytest.approx(duration, rel=1e-3)


def test_a_model_that_diverges_at_every_timestep_is_no_recommendation(capsys):
    unstable = OSCILLATOR.replace('stiffness="100"', 'stiffness="-1e9"')
    advice = mm.advise(*started(unstable, [AMPLITUDE]), budget=5)
    print(advice)
    assert not advice.method
    assert (
        "no recommendation: the model diverges at every timestep tried" in capsys.readouterr().out
    )


@pytest.mark.parametrize("phase", ["time_in_turns", "find_rest"])
def test_an_interruption_gives_what_is_known(phase, monkeypatch, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(survey, phase, interrupt)
    advice = mm.advise(*started(PENDULUM, [1.0, 0.5]), budget=10)
    print(advice)
    assert len(advice.points) > 20
    assert advice.method == "RK4"
    assert "interrupted: this is what is known so far" in capsys.readouterr().out


def test_an_interrupted_reference_is_no_recommendation(monkeypatch, capsys):
    calls = []

    def quantity(model, data):
        calls.append(data.time)
        if len(calls) > 500:
            raise KeyboardInterrupt
        return data.qpos[0]

    advice = mm.advise(*started(PENDULUM, [1.0, 0.5]), quantity=quantity, budget=10)
    print(advice)
    assert (advice.points, advice.method) == ((), "")
    assert "interrupted before a reference was found" in capsys.readouterr().out
