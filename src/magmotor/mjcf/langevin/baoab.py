"""The Langevin splitting BAOAB for MuJoCo models (Leimkuhler and Matthews, 2013).

A step h consists of B, a kick by the forces for h/2; A, free motion for h/2; O, exact integration
of damping and noise for h; A again; and B with the forces at the new configuration, which also
serve the first B of the next step. The method is of second order, and damping and noise have the
exact temperature for any h. No constraints are solved.
"""

import mujoco
import numpy as np

from magmotor.mjcf import hooks
from magmotor.mjcf.langevin.compiled_loop import compiled
from magmotor.mjcf.langevin.model import langevin_model
from magmotor.mjcf.langevin.step_coefficients import step_coefficients
from magmotor.mjcf.langevin.thermostat import Steps, Taken, Thermostat
from magmotor.mjcf.overwritten import note_wrenches
from magmotor.numerics.compilation_notice import compile_here


class Baoab(Thermostat):
    """Langevin dynamics by the BAOAB splitting, for bodies that are each attached to the world.

    This is the case of `Langevin` in which inertia, damping and noise are constant, which saves
    most of the work; the noise is that of the model's Brownian wrenches.

    The method is of second order and evaluates forces once per step. The forces are those that
    `magnetism` describes (dipoles, Brownian wrenches of bodies, periodic potentials of joints),
    gravity, `xfrc_applied` and `qfrc_applied`. Damping and noise are integrated exactly, so that
    their temperature does not depend on the timestep.

    Parameters
    ----------
    model : mujoco.MjModel
        Read once; do not change it afterwards. The parent of each moving body must be the world or
        a body fixed to it. Its joints must be slides followed by at most one hinge, ball or free
        joint at the center of mass. Damping is `damping` of joints and fixed tendons, or a viscous
        contact like that of the planar scenes of `build`. A body with a ball or free joint and
        unequal moments of inertia may have damping, and three equal Brownian torques about x, y
        and z. The options of the integrator and of the solver have no effect.

    Raises
    ------
    ValueError
        The model has other forces or constraints, or damping and noise are not constant linear
        maps of the velocities. The message names the element and the requirement.
    LayoutError
        This version of MuJoCo lays out its structs differently than it declares.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> model = mm.build(mm.Motor())
    >>> data = mujoco.MjData(model)
    >>> langevin = mm.Baoab(model)
    >>> langevin.step(data, nstep=1000)
    >>> print(f"{data.time / model.opt.timestep:.0f}")
    1000
    """

    def __init__(self, model: mujoco.MjModel):
        super().__init__(model)
        self._coefficients = step_coefficients(langevin_model(model), model.opt.timestep)
        self._advance = compiled()

    def step(self, data: mujoco.MjData, nstep: int = 1) -> None:
        """Advance the state by steps of the model's timestep.

        This changes `qpos`, `qvel`, `time`, the frames of bodies, geoms and sites, and
        `xfrc_applied`, which then contains the final forces of the dipoles. It runs
        without the GIL and needs no `magnetism` block. The result has the same bits if the steps
        are divided among several calls. Ctrl-C is checked about every 0.1 s, between two steps.

        Parameters
        ----------
        data : mujoco.MjData
            Data of this model. `userdata` selects the Brownian path, as in `magnetism`, and `time`
            the step of that path.
        nstep : int
            Number of steps, less than 2^53.

        Raises
        ------
        ValueError
            The data belong to another model, the timestep was changed, or `nstep` is invalid.
        FloatingPointError
            The state is lost: it is not finite, or a speed has reached 1e10.
        mujoco.FatalError
            The same errors as in `magnetism`.
        """
        self._steps(data, nstep, np.empty(0))

    def _compile(self) -> None:
        records, work = np.empty((0, 0)), np.empty(0)
        compile_here(self._advance, 0, 0, 0, 0, self._coefficients, records, work)

    def _run(self, data: mujoco.MjData, steps: Steps) -> Taken:
        """Call the compiled loop, which records every step, and for which `userdata` is the path.

        See `advance` in `magmotor.mjcf.langevin.compiled_loop`.
        """
        self._check_run(data)
        work = np.empty(3 * len(self._coefficients.kick) + self._coefficients.channels)
        with hooks.errors_raised():
            addresses = self.model._address, data._address
            following = self._advance(
                *addresses, steps.first, steps.nstep, self._coefficients, steps.records, work
            )
        note_wrenches(self.model, data)
        return Taken(following, steps.exchanged)


def record_exchange(splitting: Baoab) -> None:
    """Make `rollout` also return `qpos` at part O, and `qvel` before and after it."""
    splitting._recorded = 2 * splitting.model.nq + 3 * splitting.model.nv
