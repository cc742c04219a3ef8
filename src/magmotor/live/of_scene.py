"""The live simulation of a scene."""

from magmotor.arguments import Seconds, checked
from magmotor.checks import check_choice
from magmotor.devices import device_of
from magmotor.engines.mujoco.methods import METHODS
from magmotor.engines.mujoco.run import INTEGRATORS
from magmotor.live.panel import Panel
from magmotor.live.simulation import LiveSimulation
from magmotor.scenes import Disk, Motor, Top


@checked
def live_scene(
    scene: Top | Motor | Disk,
    *,
    method: str = "mujoco/euler",
    timestep: Seconds,
    seed: int = 0,
) -> LiveSimulation:
    """Make a scene live, with sliders for what it has of tilt, height, friction, temperature.

    Untouched, it moves as `simulate` says.

    Parameters
    ----------
    scene : Top, Motor or Disk
    method : str
        `mujoco/euler`, `mujoco/implicitfast` or `mujoco/rk4`.
    timestep : float
        In seconds; of the disk dimensionless.
    seed : int
        Of the Brownian forces.

    Raises
    ------
    ValueError
        Names the argument, its value and the bound.
    """
    check_choice("method", method, METHODS)
    device_of(scene).check_run(scene, method, timestep, None)
    panel = Panel(scene)
    model = panel.model()
    model.opt.timestep = timestep
    model.opt.integrator = INTEGRATORS[method.split("/")[1]]
    return LiveSimulation(model, panel=panel, seed=seed)
