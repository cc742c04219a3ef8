"""Programs without Python: the library as a plugin of MuJoCo in C."""

import ctypes

import mujoco
import numpy as np
import pytest
from c_host import (
    FOREIGN,
    LEVITATION,
    NEEDED,
    TOP,
    agree,
    numbers,
    run,
    written,
)
from hosted_models import FILES, MANY, MODELS, OF_MANY, STEPS, started, state, state_after, states

import magmotor as mm
from library.exercise import NEEDLE
from magmotor_plugin import slots
from magmotor_plugin.library import library as mujoco_library

pytestmark = NEEDED


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """Files of models with many magnets."""
    return written(tmp_path_factory.mktemp("many"), MANY.values())


def test_the_bits_are_those_of_python(tmp_path, many):
    few = written(tmp_path, MODELS.values())
    done = [run("steps", STEPS, [*few, *FILES]), run("steps", OF_MANY, many)]
    lines = "".join(each.stdout for each in done).splitlines()
    expected = states()
    names = [*MODELS, *FILES, *MANY]
    rows = zip(names, map(numbers, lines), expected, strict=True)
    assert [name for name, found, state in rows if not agree(found, state)] == []
    assert len({*map(tuple, expected)}) == len(names) > 22  # each does something of its own
    assert [each.stderr for each in done] == ["", ""]


def test_forces_have_the_bits_of_python(tmp_path, many):
    """On aarch64, MuJoCo rounds differently when it turns them into those of oblique joints."""
    paths = [*written(tmp_path, MODELS.values()), *FILES, *many]
    lines, equal = iter(run("forces", 0, paths).stdout.splitlines()), 0
    for path in paths:
        model = mujoco.MjModel.from_xml_path(str(path))
        data = started(model)
        mujoco.mj_forward(model, data)
        assert numbers(next(lines)) == [*data.site_xpos.flat, *data.site_xmat.flat]
        found, expected = numbers(next(lines)), [*data.qfrc_passive, *state(data)]
        equal += found == expected
        bound = 3e-16 * max(map(abs, data.qfrc_passive))  # 1.1e-17 of the largest
        np.testing.assert_allclose(found, expected, rtol=0, atol=bound if FOREIGN else 0)
    assert equal == (len(paths) - 4 if FOREIGN else len(paths))


def test_the_callback_has_them_too(tmp_path):
    mark = '<custom><text name="magmotor" data="dipoles"/></custom>'
    before, _, rest = NEEDLE.partition("<extension>")
    (path,) = written(tmp_path, [before + mark + rest.partition("</extension>")[2]])
    model = mujoco.MjModel.from_xml_path(str(path))
    with mm.magnetism():
        expected = state_after(model, 1000)
    assert agree(numbers(run("callback", 1000, [path]).stdout), expected)
    assert not agree(state_after(model, 1000), expected)


@pytest.mark.parametrize(
    ("name", "steps"), [("top", 500), *((name, OF_MANY) for name in MANY)], ids=["top", *MANY]
)
def test_threads_have_the_same_bits(name, steps, many):
    path = TOP if name == "top" else many[[*MANY].index(name)]
    lines = run("threads", steps, [path]).stdout.splitlines()
    assert len(lines) == 4
    model = mujoco.MjModel.from_xml_path(str(path))
    (found,) = {*map(tuple, map(numbers, lines))}
    assert agree(found, state_after(model, steps))


def test_mujoco_knows_the_same_of_the_plugins():
    find, expected = mujoco_library().mjp_getPluginAtSlot, []
    find.restype = ctypes.POINTER(slots.Plugin)
    state_after(mujoco.MjModel.from_xml_path(str(LEVITATION)), 1)
    functions = "nstate", "nsensordata", "init", "destroy", "copy", "reset", "compute"
    for name in slots.NAMES:
        plugin = find(slots.slot(name)).contents
        keys = [plugin.attributes[k].decode() for k in range(plugin.nattribute)]
        given = "".join(str(int(bool(getattr(plugin, function)))) for function in functions)
        outputs = 3 if plugin.nsensordata else 0
        expected.append(
            f"{name.decode()} {len(keys)} {''.join(keys) or '-'} {plugin.capabilityflags}"
            f" {plugin.needstage} {outputs} {given}"
        )
    assert run("plugins", 0, [TOP]).stdout.splitlines() == expected
