"""Atomic files: remains of killed processes, devices, pipes and links."""

import os
import socket
import stat
import subprocess
import sys
import threading

import pytest

from magmotor.common import files as whole_files
from magmotor.common.files import whole_file

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="devices, pipes and links")


def put(path, content=b"new"):
    with whole_file(path) as part:
        part.write_bytes(content)


@pytest.fixture(scope="module")
def dead():
    """The number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_parts_of_the_dead_of_this_machine_are_removed_and_no_others(tmp_path, dead):
    host, alive = socket.gethostname(), os.getpid()
    gone = [f".run.12@{host}.{dead}.npz", f".run.999@{host}.{dead}.npz"]
    stay = [
        f".run.12@{host}.{alive}.npz",
        f".run.12@{host}.1.npz",
        f".run.12@{host}-2.{dead}.npz",
        f".run.12@another.{dead}.npz",
        f".run.12@{host}.{dead}.nc",
        f".other.12@{host}.{dead}.npz",
        f".run.12@{host}.{dead}x.npz",
        f".run.12.{dead}.npz",
        f"run.12@{host}.{dead}.npz",
        "run.mine.npz",
    ]
    for name in gone + stay:
        (tmp_path / name).touch()
    put(tmp_path / "run.npz")
    assert {file.name for file in tmp_path.iterdir()} == {*stay, "run.npz"}


def test_a_killed_writer_s_part_is_gone_after_the_next_run(tmp_path):
    """The writer is killed between the first byte and the name."""
    path = tmp_path / "run [1].npz"
    code = (
        "import os, signal, sys; from pathlib import Path\n"
        "from magmotor.common.files import whole_file\n"
        "with whole_file(Path(sys.argv[1])) as part:\n"
        "    part.write_bytes(b'half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", code, path], check=False)
    (left,) = tmp_path.iterdir()
    assert left.read_bytes() == b"half"
    put(path)
    assert [*tmp_path.iterdir()] == [path]
    assert path.read_bytes() == b"new"


def test_names_as_long_as_they_may_be(tmp_path):
    path = tmp_path / ("ä" * 125 + ".npz")
    put(path)
    assert path.read_bytes() == b"new"


def test_a_link_stays_and_leads_to_the_new_file(tmp_path):
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    target, link = folder / "run.nc", tmp_path / "link.nc"
    link.symlink_to("elsewhere/run.nc")
    for content in (b"first", b"second"):  # it leads nowhere at first
        put(link, content)
        assert link.is_symlink()
        assert target.read_bytes() == content
    assert sorted(file.name for file in tmp_path.rglob("*")) == ["elsewhere", "link.nc", "run.nc"]


@pytest.mark.parametrize("name", ["missing/run.nc", "folder.nc"])
def test_an_error_names_the_file_that_was_asked_for(tmp_path, name):
    (tmp_path / "folder.nc").mkdir()
    with pytest.raises((FileNotFoundError, IsADirectoryError)) as caught:
        put(tmp_path / name)
    assert caught.value.filename == str(tmp_path / name)
    assert caught.value.filename2 is None
    assert [*tmp_path.iterdir()] == [tmp_path / "folder.nc"]


def device(folder, minor):
    """The null device (3) or the full one (7); root, who could destroy these, gets copies."""
    name = {3: os.devnull, 7: "/dev/full"}[minor]
    if os.getuid() != 0:
        return whole_files.Path(name)
    path = folder / str(minor)
    try:
        os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, minor))
    except PermissionError:
        pytest.skip("root may make no devices here")
    return path


def test_devices_stay_what_they_are(tmp_path):
    null = device(tmp_path, 3)
    link = tmp_path / "link"
    link.symlink_to(null)
    for path in (null, link):
        put(path)
        assert path.is_char_device()
    full = device(tmp_path, 7)
    if full.exists():
        with pytest.raises(OSError, match="No space left on device"):
            put(full)
        assert full.is_char_device()


def test_a_pipe_gets_the_whole(tmp_path):
    """The writer may seek, as for netCDF and movies."""
    path, heard = tmp_path / "pipe.nc", []
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: heard.append(path.read_bytes()))
    reader.start()
    with whole_file(path) as part, part.open("wb") as file:
        file.write(b"0123")
        file.seek(1)
        file.write(b"xy")
    reader.join()
    assert heard == [b"0xy3"]
    assert path.is_fifo()


@pytest.mark.parametrize("redirected", [True, False])
def test_standard_output_is_written_to_as_it_is(tmp_path, redirected):
    code = (
        "import sys; from pathlib import Path; from magmotor.common.files import whole_file\n"
        "print('before', flush=True)\n"
        "with whole_file(Path('/dev/stdout')) as part: part.write_text('content')\n"
    )
    out = tmp_path / "out"
    with out.open("wb") as file:
        done = subprocess.run(
            [sys.executable, "-c", code], stdout=file if redirected else subprocess.PIPE, check=True
        )
    said = out.read_bytes() if redirected else done.stdout
    assert said == b"before\ncontent"
    assert [*tmp_path.iterdir()] == [out]
