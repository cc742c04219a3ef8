"""The cache folder for compiled code if neither package nor home is writable."""

import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from numba import config

import magmotor
from magmotor.common import environment as cache_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there is always a home")


@pytest.fixture
def nowhere(monkeypatch, tmp_path):
    """Neither the package nor the home directory is writable."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")  # so that what is chosen here goes at the end
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(os, "access", lambda *_: False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("numba.config.CACHE_DIR", "")
    return tmp_path / f"magmotor-{os.getuid()}"


def test_a_private_folder_is_made_and_used(nowhere):
    for _ in range(2):
        os.environ.pop("NUMBA_CACHE_DIR", None)
        cache_folder.choose_cache_folder()
        assert os.environ["NUMBA_CACHE_DIR"] == vars(config)["CACHE_DIR"] == str(nowhere)
    assert stat.S_IMODE(nowhere.stat().st_mode) == 0o700


@pytest.mark.parametrize(
    "spoil",
    [
        lambda folder: folder.mkdir() or folder.chmod(0o770),
        lambda folder: folder.symlink_to(folder.parent),
        lambda folder: folder.touch(),
    ],
    ids=["others can write", "a link", "a file"],
)
def test_a_folder_that_others_may_have_filled_is_never_used(nowhere, spoil):
    spoil(nowhere)
    with pytest.raises(RuntimeError, match="set NUMBA_CACHE_DIR to a folder of your own"):
        cache_folder.choose_cache_folder()
    assert "NUMBA_CACHE_DIR" not in os.environ


def test_a_folder_of_another_user_is_never_used(nowhere, monkeypatch):
    nowhere.mkdir(mode=0o700)
    other = os.getuid() + 1
    nowhere.rename(nowhere.with_name(f"magmotor-{other}"))
    monkeypatch.setattr(os, "getuid", lambda: other)
    with pytest.raises(RuntimeError, match="belongs to another user"):
        cache_folder.choose_cache_folder()


def test_what_the_user_chose_stays(nowhere, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/chosen")
    cache_folder.choose_cache_folder()
    assert os.environ["NUMBA_CACHE_DIR"] == "/chosen"
    assert not nowhere.exists()


def test_a_read_only_package_and_no_home(tmp_path):
    """Another process compiles with its own copy of the package."""
    copy, temporary = tmp_path / "library" / "magmotor", tmp_path / "temporary"
    package = Path(magmotor.__file__).parent
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(package.with_name("magmotor_plugin.py"), copy.parent)
    for folder in (copy, *copy.glob("**/")):
        folder.chmod(0o555)
    temporary.mkdir()
    code = "import magmotor as mm; print(mm.__file__, mm.noise.normal(1, 0, 0, 0, 1, 0))"
    command = [sys.executable, "-B", "-c", code]
    if os.getuid() == 0:  # whom permissions do not bind
        mount = 'mount --bind "$0" "$0" && mount -o remount,ro,bind "$0" && exec "$@"'
        command = ["unshare", "-m", "sh", "-c", mount, copy, *command]
    settings = {"HOME": os.devnull, "TMPDIR": str(temporary), "PYTHONPATH": str(copy.parent)}
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "XDG"))}
    done = subprocess.run(
        command, env={**clean, **settings}, capture_output=True, text=True, check=False
    )
    for folder in copy.glob("**/"):
        folder.chmod(0o755)
    if done.stderr.startswith(("unshare", "mount")):
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(copy))
    assert [*temporary.glob(f"magmotor-{os.getuid()}/magmotor_*/noise.*.nbc")]
