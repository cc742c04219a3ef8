"""Field and magnetic energy of a model's dipoles in a state, for pictures, sensors and checks."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor import dipoles
from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import reject
from magmotor.common.hints import Points
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.forces.marks import COUPLINGS, DIPOLES


@checked
def field(model: mujoco.MjModel, data: mujoco.MjData, points: Points) -> Array:
    """Compute the magnetic field of all dipoles of a model; `magnetism` says which these are.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        Its site positions and orientations must be up to date, as after `mj_step`, `mj_forward` or
        `mj_kinematics`.
    points : array_like, shape (..., 3)
        World coordinates in m.

    Returns
    -------
    ndarray, shape (..., 3)
        Magnetic flux density in T.

    Raises
    ------
    ValueError
        A point coincides with a dipole, or the data belong to another model.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> model = mujoco.MjModel.from_xml_string('''
    ... <mujoco><worldbody><site user="1"/></worldbody></mujoco>''')
    >>> data = mujoco.MjData(model)
    >>> mujoco.mj_forward(model, data)
    >>> mm.field(model, data, [0, 0, 0.1])
    array([0.    , 0.    , 0.0002])
    """
    positions, moments, _ = dipole_sites(model, data)
    return dipoles.field(points, positions, moments)


@checked
def magnetic_energy(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Compute the energy of the dipoles of different rigid bodies in one another's field.

    It is the sum of -c m_i . B_j(x_i) over all pairs of dipoles that act on one another, where c is
    the factor of their bodies' coupling; the forces of `magnetism` are its negative gradient.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        Its site positions and orientations must be up to date, as after `mj_forward`.

    Returns
    -------
    float
        In J.

    Raises
    ------
    ValueError
        Two dipoles that act on one another coincide, or the data belong to another model.
    """
    positions, moments, bodies = dipole_sites(model, data)
    factors = coupling_factors(model)
    magnets = np.unique(bodies)
    energy = 0.0
    for k, body in enumerate(magnets):
        own = bodies == body
        strengths = np.array([factors(int(body), int(other)) for other in magnets[:k]])
        for factor in np.unique(strengths[strengths != 0.0]):
            source = np.isin(bodies, magnets[:k][strengths == factor])
            there = dipoles.field(positions[own], positions[source], moments[source])
            energy -= factor * float(np.sum(moments[own] * there))
    return energy


def dipole_sites(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array, NDArray]:
    """Positions (n, 3) in m, moments (n, 3) in A m^2 and bodies (n,) of the sites with a moment."""
    if len(data.site_xpos) != model.nsite:
        raise reject("number of sites of data", len(data.site_xpos), f"must be {model.nsite}")
    acts = model.nuser_site and acting_forces(model) & DIPOLES
    strengths = model.site_user[:, 0] if acts else np.zeros(model.nsite)
    sites = np.flatnonzero(strengths)
    axes = data.site_xmat[sites].reshape(-1, 3, 3)[..., 2]
    return data.site_xpos[sites], strengths[sites, np.newaxis] * axes, model.site_bodyid[sites]


def coupling_factors(model: mujoco.MjModel):
    """The function that says how strongly the dipoles of two bodies act on one another."""
    factors: dict[frozenset[int], float] = {}
    for k in range(model.ntuple if acting_forces(model) & COUPLINGS else 0):
        if model.tuple(k).name.startswith("coupling"):
            first = model.tuple_adr[k]
            pair = frozenset(model.tuple_objid[first : first + 2].tolist())
            factors[pair] = factors.get(pair, 1.0) * float(model.tuple_objprm[first])

    weld = model.body_weldid.tolist()
    moves = (model.body_dofnum[model.body_weldid] > 0).tolist()

    def factor(body: int, other: int) -> float:
        if weld[body] == weld[other] or not (moves[body] or moves[other]):
            return 0.0
        return factors.get(frozenset({body, other}), 1.0) if factors else 1.0

    return factor
