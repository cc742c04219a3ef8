"""A long way between two records is cut into calls of compiled code: heard, and to the bit."""

import signal
import threading
import time

import pytest

import magmotor as mm
from magmotor.engines import job as jobs
from magmotor.noise import BrownianPath

PATHS = {"own": lambda p: p, "coarse": lambda p: p.coarsened(3), "fine": lambda p: p.refined(2)}


@pytest.mark.parametrize("view", PATHS)
@pytest.mark.parametrize(
    ("scene", "scheme"),
    [
        (mm.Disk(), "euler"),
        (mm.Disk(), "baoab"),
        (mm.LangevinParticle(), "verlet"),
        (mm.Motor(), "baoab"),
        (mm.Motor(), "euler"),
    ],
)
def test_pieces_change_no_bit(scene, scheme, view, monkeypatch):
    path = PATHS[view](BrownianPath(3, 0.015))
    arguments = {
        "method": f"variational/{scheme}", "path": path, "replicas": 2, "record_interval": 50,
        "duration": 100 * path.timestep,
    }  # fmt: skip
    monkeypatch.setattr(jobs, "CHUNK", 60)
    whole = mm.simulate(scene, **arguments)
    monkeypatch.setattr(jobs, "PIECE", 14)
    monkeypatch.setattr(jobs, "FEWEST", 3)
    assert mm.simulate(scene, **arguments).identical(whole)


@pytest.mark.parametrize("scene", [mm.Disk(), mm.Motor()], ids=["disk", "motor"])
def test_ctrl_c_is_heard_on_the_way_to_a_record(scene):
    threading.Timer(0.5, signal.raise_signal, [signal.SIGINT]).start()
    began = time.monotonic()
    with pytest.raises(mm.SimulationInterrupted):
        mm.simulate(
            scene, method="variational/baoab", timestep=0.05, duration=1e10, record_interval=10**11
        )
    assert time.monotonic() - began < 30  # 1
