"""How many steps a frame takes, so that simulated time follows the clock on the wall."""

from magmotor.arguments import NotNegative, Positive, checked

LONGEST_FRAME = 0.2
"""Wall time (s) of a frame that is made up for; what a slow machine is further behind is lost."""


class Pace:
    """Simulated seconds owed to the wall's.

    Parameters
    ----------
    speed : float
        Simulated seconds in a second; may be changed.
    now : float
        Time (s) on the wall.
    """

    @checked
    def __init__(self, speed: NotNegative, now: float):
        self.speed, self._then, self._owed = speed, now, 0.0

    @checked
    def steps(self, now: float, timestep: Positive) -> int:
        """How many whole steps (s) are due at a time (s) on the wall; they count as taken."""
        self._owed += self.speed * min(now - self._then, LONGEST_FRAME)
        self._then = now
        due = int(self._owed / timestep)
        self._owed -= due * timestep
        return due
