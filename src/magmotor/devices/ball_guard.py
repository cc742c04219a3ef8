"""The guard on a run: which recorded states no accurate solution can have."""

from collections.abc import Iterator

from numpy.typing import NDArray

from magmotor.devices.first_failure import ENERGY_GREW, LARGEST_ERROR, Fault, FirstFailure
from magmotor.observables.motion import BallEnergy, ball_energy
from magmotor.scenes import Top
from magmotor.states.ball import BallStates

LARGEST_WORK = 10.0
"""Energy that a ring which moves may add, over what is in play at the start."""


class Guard(FirstFailure):
    """Finds the first wrong row among recorded states of a scene.

    Parameters
    ----------
    scene : Top
    first : BallStates
        The initial state; it sets the energy that the motion may have.
    """

    def __init__(self, scene: Top, first: BallStates):
        self.scene = scene
        start = ball_energy(scene, first)
        # A ring at rest does no work, and friction only takes.
        work = LARGEST_WORK if scene.ring_script else 0.0
        self.largest_energy = float((start.total + work * _in_play(start))[0])

    def _faults(self, states: BallStates) -> Iterator[Fault]:
        found = ball_energy(self.scene, states)
        error = LARGEST_ERROR * _in_play(found)
        yield found.total > self.largest_energy + error, lambda _: ENERGY_GREW
        if self.scene.surface == "planar":
            weight = self.scene.ball_mass * self.scene.gravity
            yield found.lift > weight, lambda row: lifted(found.lift[row], weight)


def _in_play(energy: BallEnergy) -> NDArray:
    return energy.kinetic + abs(energy.magnetic)


def lifted(lift: float, weight: float) -> str:
    """What to say of a lift and a weight, both in N."""
    return (
        f"the magnetic lift, {lift:.3g} N, exceeds the ball's weight, {weight:.3g} N, and the"
        " plane cannot hold it down: use a larger gravity or surface = 'plane'"
    )
