"""The library that is compiled ahead of time: which one is taken, and how Python calls it."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import typeof

import magmotor as mm
from library.ahead_of_time import kind_of
from magmotor.mjcf import layout
from magmotor.mjcf.declarations import reader
from magmotor.numerics import native_library
from magmotor.numerics.native_calls import _packed
from magmotor.numerics.native_library import UnfitLibraryError, described, with_description

TESTS = Path(__file__).parents[1]
LIBRARY = native_library.library()
BUILT = pytest.mark.skipif(LIBRARY is None, reason="there is no library: python -m library.build")
DESCRIPTION = {
    "format": native_library.FORMAT, "machine": os.uname().machine, "level": "", "offsets": [],
    "functions": {},
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda content: content[:-1], "damaged"),
        (lambda content: content[: len(content) // 2], "damaged"),
        (lambda content: content[:9] + bytes([content[9] ^ 1]) + content[10:], "damaged"),
        (lambda _: b"", "damaged"),
        (lambda _: b"a text of someone else", "damaged"),
        (lambda _: with_description(b"", DESCRIPTION | {"format": 0}), "its format is 0"),
        (lambda _: with_description(b"", DESCRIPTION | {"machine": "m68k"}), "it is for m68k"),
    ],
)
def test_a_file_that_is_no_library_is_not_loaded(change, reason, tmp_path):
    path = tmp_path / "library.so"
    content = with_description(b"content of a library", DESCRIPTION)
    path.write_bytes(content)
    assert described(path) == DESCRIPTION
    path.write_bytes(change(content))
    with pytest.raises(UnfitLibraryError) as found:  # refused before anything of it runs
        described(path)
    assert reason in str(found.value)


def test_a_file_that_others_can_write_to_is_not_loaded(tmp_path):
    path = tmp_path / "library.so"
    path.write_bytes(with_description(b"", DESCRIPTION))
    assert described(path) == DESCRIPTION
    path.chmod(0o666)
    with pytest.raises(UnfitLibraryError) as found:
        described(path)
    assert "others can write to it" in str(found.value)
    path.chmod(0o644)
    tmp_path.chmod(0o777)
    with pytest.raises(UnfitLibraryError):
        described(path)


def test_what_is_no_object_is_named_and_the_rest_works(tmp_path, monkeypatch):
    folder = tmp_path / "native"
    folder.mkdir()
    level = native_library.LEVELS[os.uname().machine][0]
    path = folder / f"libmagmotor-{level}.so"
    path.write_bytes(with_description(b"no object", DESCRIPTION))
    program = f"""
    from pathlib import Path
    from magmotor.numerics import native_library
    native_library.FOLDER = Path({str(folder)!r})
    import magmotor as mm
    print(mm.noise.normal(1, 2, 3, 4, 1, 0))
    assert native_library.library() is None
    """
    done = _run(program)
    assert float(done.stdout) == mm.noise.normal(1, 2, 3, 4, 1, 0)
    assert f"magmotor: {path} is not used: " in done.stderr


@BUILT
def test_the_library_is_not_used_if_its_sources_or_the_layout_are_others(monkeypatch):
    define, by = reader.compiled.__wrapped__, (layout.current(),)
    assert native_library.versions(define, by)
    other = layout.current()._replace(nbody=layout.current().nbody + 8)
    assert not native_library.versions(define, (other,))
    monkeypatch.setattr(native_library.dependencies, "checksum_of", lambda _: 0)
    assert not native_library.versions(define, by)


@BUILT
def test_programs_need_no_numba(tmp_path):
    """Magnets by the plugin and by the callback, fields, noise, a thermostat, rigid bodies."""
    program = """
    import sys
    sys.modules["numba"] = sys.modules["llvmlite"] = None
    import magmotor as mm
    import mujoco
    path = sys.argv[1]
    model = mujoco.MjModel.from_xml_path(path + "/models/top_magnetic.xml")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=10)
    model = mujoco.MjModel.from_xml_path(path + "/models/levitation.xml")
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=10)
    mm.field(model, data, [[0.0, 0.0, 1.0]])
    mm.magnetic_energy(model, data)
    mm.dipoles.field([0, 0, 0.1], [[0, 0, 0]], [[0, 0, 1]])
    tree = "<mujoco><worldbody><body><joint type='hinge' damping='1'/><geom size='1'/></body>"
    tree = mujoco.MjModel.from_xml_string(tree + "</worldbody></mujoco>")
    mm.Langevin(tree, kT=1.0).sample(4 * tree.opt.timestep, replicas=2)
    for scene in (mm.Top(), mm.Motor(), mm.Motor(drag=1e-3)):
        for method in mm.methods(scene):
            if method != "scipy/dop853":
                mm.simulate(scene, method=method, timestep=1e-3, duration=1e-2)
    """
    _run(program, str(TESTS.parent))


@BUILT
def test_the_library_has_the_bits_of_numba():
    """Each program prints checksums of what depends on every kernel; one compiles all by Numba."""
    program = """
    import sys, zlib
    import numpy as np
    sys.path.append(sys.argv[1])
    from hosted_models import FILES, MANY, MODELS, states
    import magmotor as mm
    import mujoco
    found = dict(zip([*MODELS, *FILES, *MANY], states()))
    for path in FILES:
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        found["energy", path] = mm.magnetic_energy(model, data)
        found["field", path] = mm.field(model, data, [[1.0, 2.0, 3.0]])
    for view in [(factor, level) for factor in (1, 3) for level in (0, 1, 5, 40)]:
        found["noise", view] = mm.noise.normal(1, 2, 3, 4, *view)
    found["path"] = mm.noise.BrownianPath(timestep=1e-3, seed=1).increments(9)
    for scene in (mm.Top(), mm.Motor(), mm.Motor(drag=1e-3, rotational_drag=1e-6)):
        for method in mm.methods(scene):
            run = mm.simulate(scene, method=method, timestep=1e-3, duration=0.05)
            found |= {(scene, method, name): run[name].values for name in run}
    tree = "<mujoco><worldbody><body><joint type='hinge' damping='1'/><geom size='1'/></body>"
    tree = mujoco.MjModel.from_xml_string(tree + "</worldbody></mujoco>")
    run = mm.Langevin(tree, kT=1.0, seed=3).sample(0.1, replicas=2, burn_in=0.1)
    found |= {("Langevin", name): run[name].values for name in run}
    for name, value in found.items():
        if (numbers := np.asarray(value)).dtype.kind in "fi":
            print(name, zlib.crc32(numbers.tobytes()))
    """
    programs = _run(program, str(TESTS)), _run(program, str(TESTS), MAGMOTOR_LIBRARY="0")
    here, there = ({*each.stdout.splitlines()} for each in programs)
    assert len(here) > 100
    assert here ^ there == set()


def _run(program: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
    """Run a program in a new process, which must not fail."""
    lines = program.splitlines()
    indented = min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=0)
    text = "\n".join(line[indented:] for line in lines)
    done = subprocess.run(
        [sys.executable, "-c", text, *arguments], env=os.environ | environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.parametrize(
    "value",
    [
        1, -(2**63), 2**63, True, 1.5, np.bool_(True), np.int32(3), np.int64(4), np.uint64(2**63),
        np.float64(2.5), np.zeros(3), np.zeros((2, 3)), np.zeros((2, 3), order="F"),
        np.zeros((4, 4))[::2, ::2], np.zeros((2, 0)), np.zeros(3, int), np.zeros((2, 3, 4)),
        np.broadcast_to(0.0, (2, 2)), (), (1, 2.0), (np.zeros(2), (True, 3)), None, (None, 2.0),
        np.longlong(5),
    ],
    ids=repr,
)  # fmt: skip
def test_arguments_are_named_as_their_types_are_when_the_library_is_built(value):
    """Otherwise, code for other types would run."""
    assert _packed(value)[0] == kind_of(typeof(value))


@pytest.mark.parametrize(
    "value",
    [
        np.zeros(3, ">f8"), np.frombuffer(bytes(25), np.uint8)[1:].view(float), np.float32(1), "d",
        type("q", (int,), {})(5), [1.0],
    ],
    ids=repr,
)  # fmt: skip
def test_what_no_version_takes_has_a_kind_of_its_own(value):
    """Numba then decides; such arrays would be read as others, and a type named q as a word."""
    assert _packed(value) == ("of another type", b"")


def test_errors_are_those_of_numba():
    with pytest.raises(ZeroDivisionError):
        mm.noise.normal(1, 2, 3, 4, 0, 0)
    with pytest.raises(OverflowError):
        mm.noise.normal(2**64, 2, 3, 4, 1, 0)


def test_words_of_arguments_are_those_that_numba_passes():
    array = np.arange(6.0).reshape(2, 3)
    kind, words = _packed((array, 1.5, True, np.uint64(2**64 - 1)))
    found = [*np.frombuffer(words, np.int64)]
    assert kind == "(d2C,d,?,Q)"
    assert found[:9] == [0, 0, 6, 8, array.ctypes.data, 2, 3, 24, 8]
    assert found[9] == np.float64(1.5).view(np.int64)
    assert found[10:] == [1, -1]
