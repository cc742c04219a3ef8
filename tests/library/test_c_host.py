"""Programs without Python: the library as a plugin of MuJoCo in C."""

import ctypes
import math

import mujoco
import pytest
from c_host import (
    LEVITATION,
    NEEDED,
    ROOT,
    TOP,
    agree,
    numbers,
    run,
    started,
    state,
    state_after,
    written,
)
from messages import declarations

import magmotor as mm
from library.exercise import NEEDLE
from magmotor_plugin import slots
from magmotor_plugin.library import library as mujoco_library

pytestmark = NEEDED


def test_the_bits_are_those_of_python(tmp_path):
    steps, paths = 3000, [TOP, ROOT / "models" / "motor_magnetic.xml", LEVITATION]
    paths += written(tmp_path, [NEEDLE])
    done = run("steps", steps, paths)
    found = [numbers(line) for line in done.stdout.splitlines()]
    expected = [state_after(mujoco.MjModel.from_xml_path(str(path)), steps) for path in paths]
    assert all(agree(*each) for each in zip(found, expected, strict=True))
    assert done.stderr == ""


def test_forces_have_the_bits_of_python(tmp_path):
    """On every processor, since dipoles are at the same places to the bit, which is checked."""
    paths = [ROOT / "models" / f"{name}_magnetic.xml" for name in ("top", "motor", "disk")]
    paths += written(tmp_path, [NEEDLE, many(0), many(1e-3)])
    lines = iter(run("forces", 0, paths).stdout.splitlines())
    for path in paths:
        model = mujoco.MjModel.from_xml_path(str(path))
        data = started(model)
        mujoco.mj_forward(model, data)
        assert numbers(next(lines)) == [*data.site_xpos.flat, *data.site_xmat.flat]
        assert numbers(next(lines)) == [*data.qfrc_passive, *state(data)]
        assert any(data.qfrc_passive)


def test_the_callback_has_them_too(tmp_path):
    mark = '<custom><text name="magmotor" data="dipoles"/></custom>'
    before, _, rest = NEEDLE.partition("<extension>")
    (path,) = written(tmp_path, [before + mark + rest.partition("</extension>")[2]])
    model = mujoco.MjModel.from_xml_path(str(path))
    with mm.magnetism():
        expected = state_after(model, 1000)
    assert agree(numbers(run("callback", 1000, [path]).stdout), expected)
    assert not agree(state_after(model, 1000), expected)


def many(tolerance):
    """A model with more than a thousand dipoles: tiles, or clusters where errors are allowed."""
    bodies = "".join(
        f'<body pos="{k % 10 + 0.1 * math.sin(k)} {k // 10 % 10} {k // 100}"><freejoint/>'
        f'<geom size="0.1"/><site user="{10 + k % 3}"/></body>'
        for k in range(1100)
    )
    numeric = declarations.numeric("magnetic_tolerance", tolerance)
    text = '<custom><text name="magmotor" data="dipoles"/>' + numeric + "</custom>"
    extension = declarations.PLUGIN.format("")
    flags = '<option><flag contact="disable" gravity="disable"/></option>'
    return (
        f"<mujoco><extension>{extension}</extension>{flags}{text}"
        f"<worldbody>{bodies}</worldbody></mujoco>"
    )


@pytest.mark.parametrize(
    ("text", "steps"),
    [("", 500), (many(0), 2), (many(1e-3), 2)],
    ids=["top", "tiles", "clusters"],
)
def test_threads_have_the_same_bits(text, steps, tmp_path):
    (path,) = written(tmp_path, [text]) if text else [TOP]
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
