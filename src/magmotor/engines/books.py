"""Heat and work: what friction takes and noise gives along one velocity, step by step.

Euler's schemes book both with the mean of the velocity over the step's two ends. So the work is the
Stratonovich integral of alpha u dW, and neither has a bias of first order, which heat would have
with the velocity at the start.

Where friction and noise act exactly, the velocity forgets within the step, as in truth: the heat is
booked with the mean square over the two ends, which is what it is in the mean at any step. That is
c h (du)^2/4 more, and so is the work, which the mean velocity would miss by as much.

Plain sums over 1e7 steps lose some 1e-13 of themselves to rounding.
"""

from numba import njit


@njit(inline="always")
def heat_and_work(before, after, friction, noise, increment, timestep, exact):
    """Heat c u^2 h and work alpha u dW of a step, in J, along the velocity u.

    `exact` says how friction and noise act in the step.
    """
    mean, change = 0.5 * (before + after), after - before
    within = 0.25 * friction * change * change * timestep if exact else 0.0
    return friction * mean * mean * timestep + within, noise * mean * increment + within
