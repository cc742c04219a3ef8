"""Checksums of source code, and which code Numba's disk cache gives to whom."""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import pytest

import magmotor as mm
from magmotor import code_version, models_folder
from magmotor.code_version import machine_versions, package_checksum
from magmotor.engines.variational import lanes, rigid_kernel

FACTORY = """
from numba import njit
from magmotor.code_version import specialised

def made(number):
    @njit(cache=True)
    @specialised(*by(number))
    def told():
        return number
    return told

def by(number):
    return {by}
"""

SAVE = """
import itertools, sys, time
from pathlib import Path
from numba.core.caching import IndexDataCacheFile as File
import factory

number, other = int(sys.argv[1]), 3 - int(sys.argv[1])
reads = itertools.count()
load, save_index, save_data = File._load_index, File._save_index, File._save_data

def reached(what):
    Path(f"{what}_{number}").touch()

def wait(what):
    until = time.monotonic() + 60
    while not Path(f"{what}_{other}").exists():
        assert time.monotonic() < until, what
        time.sleep(0.01)

def both_have_read(self):
    index, what = load(self), f"read_{next(reads)}"
    reached(what)
    wait(what)
    return index

def one_after_two(self, index):
    if number == 1:
        wait("index")
    save_index(self, index)
    reached("index")

def two_after_one(self, name, data):
    if number == 2:
        wait("data")
    save_data(self, name, data)
    reached("data")

if len(sys.argv) > 2:
    File._load_index, File._save_index = both_have_read, one_after_two
    File._save_data = two_after_one
print(factory.made(number)())
"""


def _python(folder: Path, *arguments: str) -> subprocess.Popen:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
    command = [sys.executable, "save.py", *arguments]
    return subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True)


def _told(folder: Path, by: str) -> list[str]:
    """What two processes tell that load what two others saved at once."""
    folder.mkdir()
    (folder / "factory.py").write_text(FACTORY.format(by=by))
    (folder / "save.py").write_text(SAVE)
    at_once = [_python(folder, number, "at once") for number in "12"]
    assert [process.communicate()[0].strip() for process in at_once] == ["1", "2"]
    return [_python(folder, number).communicate()[0].strip() for number in "12"]


def test_processes_that_compile_at_once_do_not_exchange_their_code(tmp_path):
    assert _told(tmp_path / "one_index", "()") == ["2", "2"]  # Numba's own fault: 1 got 2's code
    assert _told(tmp_path / "own_index", "(number,)") == ["1", "2"]


def test_every_specialisation_of_a_kernel_has_its_own_index():
    compiled: list[Any] = [
        *(lanes.kernel(mm.Disk(), scheme) for scheme in ("euler", "baoab")),
        *(lanes.kernel(mm.Disk(potential=U), "baoab") for U in ("cosine", "asymmetric")),
        lanes.kernel(mm.Disk(friction_ratio=1.0), "baoab"),
        *(rigid_kernel.kernel(scheme) for scheme in ("euler", "cayley", "baoab")),
    ]
    indices = {function._cache._cache_file._index_path for function in compiled}
    assert len(indices) == len(compiled)


def test_newer_code_replaces_the_files_of_older_code():
    compiled: list[Any] = [
        lanes._compile((1, 0), (True, False), True, (1, 1), checksum) for checksum in (1, 2)
    ]
    older, newer = (function._cache._cache_file._index_path for function in compiled)
    assert older == newer


def test_the_checksum_is_that_of_the_bytes_wherever_they_are(tmp_path, monkeypatch):
    package = Path(code_version.__file__).parent
    here = package_checksum()
    ignore = shutil.ignore_patterns("__pycache__", "models")
    installed = shutil.copytree(package, tmp_path / "zebra" / "magmotor", ignore=ignore)
    shutil.copytree(models_folder.models_folder(), installed / "models")
    monkeypatch.setattr(code_version, "__file__", str(installed / "code_version.py"))
    monkeypatch.setattr(code_version, "models_folder", lambda: installed / "models")
    assert package_checksum.__wrapped__() == here
    (installed / "models" / "added.xml").write_text("<mujoco/>")
    assert package_checksum.__wrapped__() != here


@pytest.mark.parametrize(
    ("kind", "features", "told"),
    [
        ("x86_64", {"fma": True, "avx2": True}, "x86_64 with FMA"),
        ("x86_64", {"fma": True, "avx2": False}, "x86_64"),
        ("x86_64", {"fma": False, "avx2": True}, "x86_64"),
        ("arm64", {"neon": True}, "arm64"),
    ],
)
def test_a_kind_of_machine_is_one_that_rounds_alike(kind, features, told, monkeypatch):
    monkeypatch.setattr(platform, "machine", lambda: kind)
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: features)
    assert machine_versions()["machine"] == told
