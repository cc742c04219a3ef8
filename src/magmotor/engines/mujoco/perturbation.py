"""The viewer's mouse on a body, as a force that the compiled callback leaves alone."""

import mujoco

from magmotor.arguments import checked


@checked
def apply_perturbation(
    model: mujoco.MjModel, data: mujoco.MjData, perturb: mujoco.MjvPerturb
) -> None:
    """Apply the force of the mouse in MuJoCo's viewer, before a step.

    The viewer writes it to `xfrc_applied`, which `magnetism` overwrites where dipoles, noise or
    potentials act. Here it is a generalised force, on any body.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        Its `qfrc_applied` becomes the force, zero while nothing is pulled: call this first, then
        add forces of your own by `+=`. The `xfrc_applied` of
        the selected body, where the viewer's `sync` has left the same force, becomes zero.
    perturb : mujoco.MjvPerturb
        What the mouse does: the attribute `perturb` of the viewer's handle.

    Examples
    --------
    >>> with mm.magnetism(), mujoco.viewer.launch_passive(model, data) as viewer:  # doctest: +SKIP
    ...     while viewer.is_running():
    ...         mm.apply_perturbation(model, data, viewer.perturb)
    ...         mujoco.mj_step(model, data)
    ...         viewer.sync()
    """
    data.qfrc_applied[:] = 0.0
    body = perturb.select
    if not 0 < body < model.nbody:
        return
    wrench = data.xfrc_applied[body]
    wrench[:] = 0.0
    mujoco.mjv_applyPerturbForce(model, data, perturb)
    place, force = data.xipos[body], data.qfrc_applied
    mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], place, body, force)
    wrench[:] = 0.0
