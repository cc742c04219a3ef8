"""An independent implementation of the forces of magnetism in plain NumPy, short and slow."""

import mujoco
import numpy as np


def apply_magnetism(model, data):
    """Write the magnetic wrench of every movable body with dipole sites to `xfrc_applied`."""
    if model.nuser_site == 0:
        return
    sites = np.flatnonzero(model.site_user[:, 0])
    position = data.site_xpos[sites]
    moment = model.site_user[sites, :1] * data.site_xmat[sites].reshape(-1, 3, 3)[:, :, 2]
    body = model.site_bodyid[sites]
    weld = model.body_weldid[body]
    factor = coupling_factors(model)
    for b in np.unique(body):
        if model.body_dofnum[model.body_weldid[b]] == 0:
            continue
        total = np.zeros(6)
        for i in np.flatnonzero(body == b):
            others = weld != weld[i]
            r = position[i] - position[others]
            m = moment[others] * factor[b, body[others], np.newaxis]
            d = np.linalg.norm(r, axis=1, keepdims=True)
            n = r / d
            mn, an = np.sum(m * n, axis=1, keepdims=True), n @ moment[i][:, np.newaxis]
            field = 1e-7 * np.sum((3 * mn * n - m) / d**3, axis=0)
            bracket = an * m + mn * moment[i] + (m @ moment[i])[:, np.newaxis] * n - 5 * an * mn * n
            force = 3e-7 * np.sum(bracket / d**4, axis=0)
            arm = position[i] - data.xipos[b]
            total[:3] += force
            total[3:] += np.cross(moment[i], field) + np.cross(arm, force)
        data.xfrc_applied[b] = total


def potential_forces(model, data):
    """Generalized forces -U'(q) of the joints' periodic potentials, shape (nv,)."""
    forces = np.zeros(model.nv)
    for joint in range(model.njnt if model.nuser_jnt else 0):
        q = data.qpos[model.jnt_qposadr[joint]]
        a, b = model.jnt_user[joint, : model.nuser_jnt // 2 * 2].reshape(-1, 2).T
        k = np.arange(1, len(a) + 1)
        forces[model.jnt_dofadr[joint]] -= np.sum(k * (a * np.cos(k * q) - b * np.sin(k * q)))
    return forces


def coupling_factors(model):
    """Factors of the interactions between dipoles of any two bodies, shape (nbody, nbody)."""
    factors = np.ones((model.nbody, model.nbody))
    for k in range(model.ntuple):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TUPLE, k) or ""
        if name.startswith("coupling"):
            a, b = model.tuple_objid[model.tuple_adr[k] :][:2]
            factors[a, b] *= model.tuple_objprm[model.tuple_adr[k]]
            factors[b, a] = factors[a, b]
    return factors
