"""Which step of a run the callback is in, the same in all stages of a Runge-Kutta step.

MuJoCo sets `mjData.time` to a stage's own time: t, t + h/2, t + h/2, t + h. The last stage of a
step thus has the time of the next one's first. They differ in the stack of `mjData`, on which
`mj_RungeKutta` keeps its work: it is in use (`pstack` > 0) in all stages but the first.

Limits. Steps are counted from time 0 by the present timestep, so that both must be what they
were; the sum of timesteps that MuJoCo keeps as its time is good for some 5e7 of them. With RK4,
C code that steps or calls `mj_forward` while it holds a piece of the stack itself is taken for a
later stage. In Python none does: `mj_step`, `mj_forward`, rollouts, batches and the viewer start
from an empty stack, and `mjd_transitionFD`, which does not, refuses RK4. Other integrators call
once a step, and the stack is not looked at.

After an error in a later stage, MuJoCo's own or ours, MuJoCo leaves its stack as it was: before the
same `mjData` takes further steps, `mj_resetData` empties it.
"""

import math

from numba import njit

from magmotor.engines.mujoco import memory

RK4 = 1
"""mjINT_RK4."""


@njit(forceinline=True)
def step_number(model, data, offsets):
    """Number of the step that begins at the time of `mjData`, or that this is a stage of."""
    timestep = memory.numbers(model + offsets.timestep, 1, 1)[0, 0]
    steps = memory.numbers(data + offsets.time, 1, 1)[0, 0] / timestep
    in_stage = memory.words(data + offsets.pstack, 1)[0] != 0
    if in_stage and memory.integers(model + offsets.integrator, 1)[0] == RK4:
        # n + 1/2 and n + 1 are n, with room for rounding on both sides.
        return math.ceil(steps - 0.25) - 1
    return math.floor(steps + 0.5)
