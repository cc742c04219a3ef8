"""A long interval between records is divided into calls of compiled code: Ctrl-C, and every bit."""

import signal

import numpy as np
import pytest

import magmotor as mm
from magmotor.device import job as jobs
from magmotor.noise import BrownianPath
from magmotor.numerics import splittings

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
def test_the_division_into_calls_does_not_change_a_bit(scene, scheme, view, monkeypatch):
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
def test_ctrl_c_interrupts_a_long_interval_between_records(scene, monkeypatch):
    real = jobs.Job.pieces

    def watched(*arguments):
        for number, (first, steps) in enumerate(real(*arguments)):
            assert steps <= jobs.PIECE
            if number == 2:
                signal.raise_signal(signal.SIGINT)
            yield first, steps

    monkeypatch.setattr(jobs.Job, "pieces", watched)
    monkeypatch.setattr(jobs, "PIECE", 1000)
    with pytest.raises(mm.SimulationInterrupted):
        mm.simulate(
            scene, method="variational/baoab", timestep=0.05, duration=1e10, record_interval=10**11
        )


NEW = {
    "top": (mm.Top.paper(2, spin=2.0, velocity=(0.02, -0.01)), splittings.RIGID, "position"),
    "disk": (mm.Disk(noise=0.0, x=0.3), splittings.DISK, "x"),
}


@pytest.mark.parametrize("parts", ["OBABO", "KAK", "BOAOB", "ABOBA"])
@pytest.mark.parametrize("name", NEW)
def test_a_new_splitting_gives_the_same_run_in_pieces(monkeypatch, name, parts):
    """Its first kick may reuse the force of the previous step, which no piece starts with."""
    scene, schemes, quantity = NEW[name]
    monkeypatch.setitem(schemes, "new", splittings.evenly(parts))
    task: dict = {
        "method": "variational/new", "timestep": 0.01, "duration": 0.2, "allow_unstable": True
    }  # fmt: skip
    whole = mm.simulate(scene, **{**task, "duration": 0.4})
    first = mm.simulate(scene, **task)
    second = mm.simulate(scene, **task, initial=first)
    ends = second[quantity].values[-1], whole[quantity].values[-1]
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-15)  # 6e-17
    reference = mm.simulate(scene, **{**task, "duration": 0.4, "method": "scipy/dop853"})
    moved = abs(ends[1] - whole[quantity].values[0]).max()
    error = abs(ends[1] - reference[quantity].values[-1]).max()
    assert error < 2e-4 * moved  # 9.4e-6
