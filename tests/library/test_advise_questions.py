"""What `mm.advise` cannot answer: bad input, rest, divergence, interruptions."""

import contextlib
import copy
import math
import warnings

import mujoco
import pytest
from advised_models import AMPLITUDE, BALL, NEEDLE, OSCILLATOR, PENDULUM, TRAP, Clock, started

import magmotor as mm
from magmotor.advice import survey
from magmotor.advice.measure import Measurement
from magmotor.advice.paths import quiet
from magmotor.advice.survey import Survey


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """Budgets count steps instead of time, so that no load of the machine changes an answer."""
    return Clock(monkeypatch, step=1e-5)


def test_a_temperature_and_noise_exclude_each_other():
    with pytest.raises(ValueError, match=r"kT = 1\.0: must be omitted, since the model has noise"):
        mm.advise(*started(TRAP), kT=1.0, duration=5.0)


def test_noise_needs_room_to_choose_its_path():
    silent = TRAP.replace('<size nuserdata="5"/>', "")
    with pytest.raises(ValueError, match="nuserdata of the model = 0: must be at least 5, to"):
        mm.advise(*started(silent))


@pytest.mark.parametrize(("quantity", "sentence"), [
    ("speed", "quantity = 'speed': must be 'positions', 'energy', 'body NAME'"),
    ("joint tow", r"joint of the quantity = 'tow': must be one of one, two \(did you mean 'two'"),
    ("sensor x", "quantity = 'sensor x': the model has no sensor with a name"),
    (lambda model, data: "fast", "quantity .*: must be finite numbers"),
    (lambda model, data: math.nan, "quantity .*: must be finite numbers"),
    (lambda model, data: 1 / 0, "quantity = '<lambda>': fails: division by zero"),
    (lambda model, data: data.qpos[: 1 + (data.time > 0.1)], "always be the same number"),
    ("joint", "quantity = 'joint': must be 'positions', 'energy', 'body NAME'"),
    (lambda model, data: 1.0, "quantity .*: does not change along the path"),
])  # fmt: skip
def test_a_quantity_that_is_not_there_is_named(quantity, sentence):
    with pytest.raises(ValueError, match=sentence):
        mm.advise(*started(PENDULUM, [1.0]), quantity=quantity, budget=2)


@pytest.mark.parametrize(("arguments", "sentence"), [
    ({"error": 1e-9}, "error = 1e-09: must be"),
    ({"error": 1.0}, "error = 1.0: must be"),
    ({"duration": 0.2}, "duration = 0.2: must be at least 0.24 s, 48 timesteps"),
    ({"budget": 0.1}, "budget = 0.1: must be"),
])  # fmt: skip
def test_numbers_out_of_bounds_are_named(arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        mm.advise(*started(PENDULUM, [1.0]), **arguments)


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
    with pytest.raises(ValueError, match=r"quantity = 'at_first': is not finite along"):
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


def test_data_of_another_model_are_named():
    with pytest.raises(ValueError, match="data = 'MjData': must belong to the model"):
        mm.advise(started(PENDULUM)[0], started(OSCILLATOR)[1])


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


def test_a_picture_needs_something_measured(tmp_path):
    with pytest.raises(ValueError, match=r"points = \(\): must be measured"):
        mm.Advice(quantity="positions", error=0.01, duration=1.0).draw(tmp_path / "advice.png")
    with pytest.raises(ValueError, match="must be in an existing directory"):
        mm.advise(*started(PENDULUM, [1.0]), picture=tmp_path / "missing" / "advice.png")


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
    sentence = f"quantity = '{quantity}': does not change along the path: the model is at rest"
    with pytest.raises(ValueError, match=sentence):
        mm.advise(*state, quantity=quantity)


def test_an_element_is_found_by_its_name_in_latin_1(tmp_path):
    path = tmp_path / "model.xml"
    path.write_bytes(PENDULUM.replace('"two"', '"zw\xf6lf"').encode("latin-1"))
    model = mujoco.MjModel.from_xml_path(str(path))
    with pytest.raises(ValueError, match="'joint zw\xf6lf': does not change along the path"):
        mm.advise(model, quantity="joint zw\xf6lf")


def test_something_at_rest_beside_something_that_moves_is_named():
    model, data = settled(TOWER)
    data.qpos[-1] = 0.1
    with pytest.raises(ValueError, match="'body upper': does not change along the path; give"):
        mm.advise(model, data, quantity="body upper", budget=2)


@pytest.mark.parametrize("quantity", ["positions", "joint two", "energy"])
def test_slow_motion_is_judged(quantity):
    advice = mm.advise(*started(PENDULUM, [1e-3]), quantity=quantity, budget=5)
    assert advice.method
    assert advice.doubt < 1e-6  # 7e-8


def test_a_model_without_degrees_of_freedom_is_named():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
    )
    with pytest.raises(ValueError, match="nv of the model = 0: must be at least 1"):
        mm.advise(model, quantity=lambda _, data: data.time)


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
