"""Where the motor's energy comes from and goes to, and its efficiency."""

import xarray as xr

from magmotor.analysis import OWN, analysis
from magmotor.scenes import Motor
from magmotor.theory.motor import ball_injection_rate, ring_injection_rate


@analysis("energy", "heat", "work", of=Motor)
def motor_energy_balance(run: xr.Dataset, scene: Motor = OWN) -> xr.Dataset:
    """Energy against heat and the work of the noise.

    The paper's remarks: dE = (-c_B |V_Q|^2 - c_R |omega_R|^2) dt + r dt + martingale, with the
    rate r = alpha_B^2 (1/m + r^2/J_B) + (alpha_R^2/2) tr(I_R^-1); at non-uniform temperature c_R
    and alpha_B are zero. The last two terms together are the Stratonovich work of the noise.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`, recorded however seldom.
    scene : Motor, optional
        Its scene; by default the one that the attributes of the run tell.

    Returns
    -------
    xarray.Dataset
        In J, from the first record on: `gain` = E - E(0), `heat`, `work`, `injected` = r t,
        `martingale` = work - injected, and `residual` = gain + heat - work.
    """
    elapsed = run.time - run.time[0]
    rate = ball_injection_rate(scene) + ring_injection_rate(scene)
    injected = (rate * elapsed).broadcast_like(run.work).transpose(*run.work.dims)
    gain, heat, work = map(_since_start, (run.energy, run.heat, run.work))
    return _in_joule(
        gain=gain,
        heat=heat,
        work=work,
        injected=injected,
        martingale=work - injected,
        residual=gain + heat - work,
    )


@analysis("energy", "ring_energy", "heat", "ring_heat", "work", "ring_work", of=Motor, finite=False)
def efficiency(run: xr.Dataset, scene: Motor = OWN) -> xr.Dataset:
    """The paper's efficiency: work transferred to the top over the work of the kicks on the ring.

    What the paper leaves open is read so:

    - The work of the kicks is the integral of alpha dW . omega_R, alpha once (the paper's formula
      has it in T_R and before the integral), and in the sense of Stratonovich.
    - The ring's energy is what it has without the ball: its kinetic energy, and its energy in the
      outer ring's field. Total less ring energy is what ball and inner ring have by each other.
    - That the work of T_R is the change of the total energy holds without friction only. The work
      transferred as the paper writes it, a change of energy, leaves out what the ball's friction
      has dissipated meanwhile, which over long times is nearly all of it. `share` counts that in:
      it is the part of the kicks' work that has reached the ball. At uniform temperature it leaves
      out what the noise on the ball itself has brought; it then may have either sign, and tends to
      zero, since no heat flows on the average between two bodies of one temperature. What the
      energy balance leaves as residual is in it, too.

    Parameters
    ----------
    run : xarray.Dataset
        Of a motor, recorded as often as its efficiency is wanted.
    scene : Motor, optional
        Its scene; by default the one that the attributes of the run tell.

    Returns
    -------
    xarray.Dataset
        In J, from the first record on: `kicks`, the work on the ring, `transferred` = (E - E(0)) -
        (E_ring - E_ring(0)), and `reached` = transferred + the ball's heat - the work of its own
        noise; without unit `efficiency` = transferred/kicks and `share` = reached/kicks, NaN where
        the work on the ring is zero, as in the first record.
    """
    kicks = _since_start(run.ring_work)
    transferred = _since_start(run.energy - run.ring_energy)
    dissipated = _since_start((run.heat - run.ring_heat) - (run.work - run.ring_work))
    reached = transferred + dissipated
    moved = kicks.where(kicks != 0)
    ratios = {"efficiency": transferred / moved, "share": reached / moved}
    return _in_joule(kicks=kicks, transferred=transferred, reached=reached).assign(ratios)


def _since_start(values: xr.DataArray) -> xr.DataArray:
    """What has been added since the first record."""
    return values - values.isel(time=0, drop=True)


def _in_joule(**values: xr.DataArray) -> xr.Dataset:
    return xr.Dataset({k: v.assign_attrs(units="J") for k, v in values.items()})
