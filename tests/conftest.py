"""Shared by all tests: where the helpers are, and runs that several tests look at."""

import sys
from pathlib import Path

import pytest

import magmotor as mm

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def case4_truth():
    """Case 4 by DOP853 for 60 s, every 0.1 s; halving its tolerance moves J by 1e-13 of its max."""
    return mm.simulate(mm.Top.paper(4), method="scipy/dop853", timestep=0.1, duration=60)
