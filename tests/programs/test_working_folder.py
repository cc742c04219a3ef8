"""Processes that magmotor starts import nothing from the folder in which they start."""

import os
import subprocess
import sys

import pytest

DRIVER = """
import os, sys
import mine
import magmotor as mm
from magmotor.sweep.process_pool import Pool

if __name__ == "__main__":
    if sys.argv[1] == "pool":
        pool = Pool(1)
        print(pool.submit(mine.environment).result(120))
        pool.close()
    else:
        mm.sweep.local_cluster  # may set variables itself
        before = dict(os.environ)
        with mm.sweep.local_cluster(1) as address, mm.sweep.dask_workers(address) as (executor, _):
            # of programs that are started meanwhile
            assert {**os.environ, "__DASK_PARENT_PID": ""} == {**before, "__DASK_PARENT_PID": ""}
            print(executor.submit(mine.environment).result(120))
            os.kill(executor.submit(os.getpid).result(120), 9)
            print(executor.submit(mine.environment).result(120))
"""
MINE = """
import os

def environment():
    return f"{os.path.basename(os.getcwd())} {os.environ.get('PYTHONSAFEPATH')}"
"""
HOSTILE = "open('ran', 'a').write(__name__)\nraise SystemExit('hostile')\n"


@pytest.mark.parametrize(
    ("workers", "environment", "answers"), [("pool", "None", 1), ("dask", "1", 2)]
)
def test_workers_import_what_their_driver_can(tmp_path, workers, environment, answers):
    """That is the folder of the program, but not the working folder; a worker is started again."""
    if workers == "dask":
        pytest.importorskip("distributed")
    stranger, own = tmp_path / "stranger", tmp_path / "own"
    for folder in (stranger, own):
        folder.mkdir()
    for name in ("magmotor", "multiprocessing", "numpy", "random", "distributed"):
        (stranger / f"{name}.py").write_text(HOSTILE)
    (own / "driver.py").write_text(DRIVER)
    (own / "mine.py").write_text(MINE)
    done = subprocess.run(
        [sys.executable, own / "driver.py", workers], cwd=stranger, env={**os.environ},
        capture_output=True, text=True, timeout=200, check=False,
    )  # fmt: skip
    assert not (stranger / "ran").exists()
    assert done.stdout.splitlines() == [f"stranger {environment}"] * answers, done.stderr
