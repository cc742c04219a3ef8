"""The files of compiled code: where they are, and what happens if they are damaged or refused."""

import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from numba import config

import magmotor
from magmotor.numerics import code_files, dependencies
from magmotor.numerics.compiled_once import compiled_once

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no owners like these")


def _sum(checksum, number):
    def sum_of(x):
        _ = checksum
        return x + number

    return sum_of


def compiled():
    """What a new process would have: the function, not yet called."""
    return compiled_once()(_sum)(3)


def hits(function):
    """How often the code came from a file."""
    return sum(function.stats.cache_hits.values())


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder, which the user chose; in it, the code for integers."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    assert compiled()(4) == 7
    (found,) = tmp_path.glob("*")
    return found


def files(folder):
    return [*folder.iterdir()]


def test_each_signature_has_a_file_of_its_own(folder):
    first = files(folder)
    assert compiled()(4.5) == 7.5
    assert len(files(folder)) == 1 + len(first) == 2
    for argument in (4, 4.5):
        again = compiled()
        assert again(argument) == argument + 3
        assert hits(again) == 1


DAMAGE = {
    "empty": lambda content: b"",
    "truncated": lambda content: content[: len(content) // 2],
    "one byte short": lambda content: content[:-1],
    "garbage": lambda content: bytes(range(256)) * 30,
    "pickled garbage": lambda content: b"\x80\x04N.",
    "a flipped bit": lambda content: content[:-999] + bytes([content[-999] ^ 4]) + content[-998:],
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_file_is_made_again(folder, damage):
    (path,) = files(folder)
    whole = path.read_bytes()
    path.write_bytes(DAMAGE[damage](whole))
    cache = compiled_once()(_sum)
    assert not cache.is_cached(3)
    again = cache(3)
    assert (again(4), hits(again)) == (7, 0)
    assert cache.is_cached(3)
    healed = compiled()
    assert (healed(4), hits(healed)) == (7, 1)


def test_whole_code_that_cannot_be_loaded_is_made_again(folder, monkeypatch):
    """As after an update of what it was pickled with."""
    (path,) = files(folder)
    content = b"cnowhere\nnothing\n."
    path.write_bytes(code_files._checksum(content) + content)
    assert compiled()(4) == 7
    healed = compiled()
    assert (healed(4), hits(healed)) == (7, 1)


def refusals(capsys):
    return [line for line in capsys.readouterr().err.splitlines() if "NUMBA_CACHE_DIR" in line]


@pytest.fixture
def unexplained(monkeypatch):
    """Nothing has been said in this process."""
    monkeypatch.setattr(code_files, "_explained", False)


def test_a_full_disk_costs_only_time(folder, unexplained, monkeypatch, capsys):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    for argument in (4.5, 4.5 + 1j):
        assert compiled()(argument) == argument + 3
    (line,) = refusals(capsys)
    assert "No space left on device" in line
    assert str(folder) in line
    assert len(files(folder)) == 1  # no half-written one


def test_ctrl_c_leaves_no_half_written_file(folder, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        compiled()(4.5)
    assert len(files(folder)) == 1


def test_the_folder_that_the_user_chose_may_be_missing(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "new" / "folder"))
    for expected in (0, 1):
        function = compiled()
        assert (function(4), hits(function)) == (7, expected)


@posix
def test_nothing_can_be_written(monkeypatch, unexplained, capsys):
    monkeypatch.setattr(config, "CACHE_DIR", "/dev/null")
    assert compiled()(4) == 7
    (line,) = refusals(capsys)
    assert "compiled code cannot be kept" in line
    assert "Not a directory" in line


@pytest.fixture
def nowhere(monkeypatch, tmp_path):
    """Neither the package nor the home directory can be used; return the temporary folder."""
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setattr(dependencies, "checksum_of", lambda _: int.from_bytes(os.urandom(4)))
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    here, is_private = str(Path(__file__).with_name("__pycache__")), code_files.is_private

    def is_allowed(folder, like):
        return folder != here and is_private(folder, like)

    monkeypatch.setattr(code_files, "is_private", is_allowed)
    return tmp_path / f"magmotor-{os.getuid()}"


@posix
def test_a_private_folder_is_made_and_used(nowhere):
    assert compiled()(4) == 7
    assert len(files(nowhere)) == 1
    assert stat.S_IMODE(nowhere.stat().st_mode) & 0o022 == 0


@posix
@pytest.mark.parametrize(
    "spoil",
    [
        lambda folder: folder.mkdir() or folder.chmod(0o757),
        lambda folder: folder.mkdir() or folder.chmod(0o1777),
        lambda folder: folder.mkdir() or folder.parent.chmod(0o777),
        lambda folder: folder.touch(),
        lambda folder: folder.mkdir() or os.chown(folder, 4321, -1),
        lambda folder: folder.parent.chmod(0o1777) or os.chown(folder.parent, 4321, -1),
        lambda folder: folder.symlink_to("..") or os.lchown(folder, 4321, -1),
    ],
    ids=[
        "others can write", "anybody can write", "others can replace it", "a file",
        "of another user", "in a folder of another user", "a link of another user",
    ],
)  # fmt: skip
def test_a_folder_that_others_may_have_filled_is_never_used(nowhere, spoil, unexplained, capsys):
    """It does not stop the program, either."""
    try:
        spoil(nowhere)
    except PermissionError:
        pytest.skip("only root can give a folder away")
    assert compiled()(4) == 7
    assert not [*nowhere.glob("*.nbc")]
    (line,) = refusals(capsys)
    assert str(nowhere) in line


@posix
def test_a_link_is_followed_if_nobody_else_can_change_it(nowhere, tmp_path):
    (tmp_path / "own").mkdir()
    nowhere.symlink_to("own")
    assert compiled()(4) == 7
    assert len(files(tmp_path / "own")) == 1


@posix
@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="mounts need root")
def test_a_read_only_package_and_no_home(tmp_path):
    """Its code is used if somebody has compiled it before, and else goes to a temporary folder."""
    copy, temporary = tmp_path / "library" / "magmotor", tmp_path / "temporary"
    package = Path(magmotor.__file__).parent
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(package.with_name("magmotor_plugin"), copy.with_name("magmotor_plugin"))
    temporary.mkdir()
    code = "import magmotor as mm; print(mm.__file__, mm.noise.normal(1, 0, 0, 0, 1, 0))"
    program = [sys.executable, "-B", "-c", code]
    mount = 'mount --bind "$0" "$0" && mount -o remount,ro,bind "$0" && exec "$@"'
    settings = {"HOME": os.devnull, "TMPDIR": str(temporary), "PYTHONPATH": str(copy.parent)}
    settings["MAGMOTOR_LIBRARY"] = "0"
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "XDG"))}

    def run(*command):
        done = subprocess.run(
            command, env={**clean, **settings}, capture_output=True, text=True, check=False
        )
        if done.stderr.startswith(("unshare", "mount")):
            pytest.skip(done.stderr)
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith(str(copy))

    read_only = "unshare", "-m", "sh", "-c", mount, copy, *program
    run(*read_only)
    kept = temporary / f"magmotor-{os.getuid()}"
    assert [*kept.glob("noise.*.nbc")]
    shutil.rmtree(kept)
    run(*program)
    run(*read_only)
    assert [*copy.glob("__pycache__/noise.*.nbc")]
    assert not kept.exists()
