"""`describe`: what of a model acts, with which temperature, and what does not act and why."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

import magmotor_plugin
from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.field_and_energy import coupling_factors
from magmotor.mjcf.forces.marks import UNMARKED, WORDS
from magmotor.mjcf.langevin.checks import colliding_geoms
from magmotor.mjcf.langevin.model import joint_damping, langevin_model
from magmotor.mjcf.lookup import disabled

LISTED = 8
"""Largest number of bodies, pairs or joints that the text lists."""

MATCH = 1e-6
"""Relative difference up to which noise has the temperature of the damping."""

MARK = '<custom><text name="magmotor" data="dipoles couplings noise potentials"/></custom>'


@dataclass(frozen=True)
class Description:
    """What acts on a model; `print` shows it.

    Attributes
    ----------
    acting : tuple of str
        Out of `dipoles`, `couplings`, `noise`, `potentials`.
    marked : bool
        Whether the model says so itself.
    plugin : bool
        Whether the forces belong to the model, by the plugin `magmotor.forces`; if not, they act
        inside `magnetism()`.
    dipoles : dict of str to int
        Number of dipoles of each body that has any.
    pairs : dict of (str, str) to float
        Bodies whose dipoles act on each other, with the factor of their coupling.
    noise : dict of str to ndarray
        Brownian wrenches of each body that has any, shape (rows, 6).
    kT : tuple of float or None
        Smallest and largest temperature of the degrees of freedom in J, by the damping and noise at
        `qpos0`; equal if all have the same; infinite where nothing damps. None if it is unknown.
    unknown : str
        Why the temperature is unknown, if there is noise.
    potentials : dict of str to ndarray
        Fourier coefficients a_1 b_1 a_2 b_2 ... in J of each joint that has any.
    idle : tuple of str
        What does not act, and why.
    """

    acting: tuple[str, ...]
    marked: bool
    plugin: bool
    dipoles: dict[str, int]
    pairs: dict[tuple[str, str], float]
    noise: dict[str, Array]
    kT: tuple[float, float] | None
    unknown: str
    potentials: dict[str, Array]
    idle: tuple[str, ...]

    def __str__(self) -> str:
        """Return one line for each kind of force, and for each reason why something is idle."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        where = "by the plugin magmotor.forces" if self.plugin else "inside magmotor.magnetism()"
        acting = _joined(self.acting)
        unmarked = "" if self.marked or not self.acting else "; the model has no mark"
        yield f"acting: {f'{acting}, {where}' if acting else 'nothing'}{unmarked}"
        if self.dipoles:
            yield f"dipoles: {_listed(f'{body} {count}' for body, count in self.dipoles.items())}"
        if self.pairs:
            pairs = (
                f"{one} and {other}" + (f" (times {factor:g})" if factor != 1 else "")
                for (one, other), factor in self.pairs.items()
            )
            yield f"pairs: {_listed(pairs)}"
        if self.noise:
            rows = (f"{body} {len(wrenches)}" for body, wrenches in self.noise.items())
            yield f"noise, Brownian wrenches: {_listed(rows)}"
            yield f"temperature: {self._temperature()}"
        if self.potentials:
            terms = (f"{joint} {len(waves) // 2}" for joint, waves in self.potentials.items())
            yield f"periodic potentials, Fourier terms: {_listed(terms)}"
        yield from (f"not acting: {reason}" for reason in self.idle)

    def _temperature(self) -> str:
        if self.kT is None:
            return f"unknown, since {self.unknown}"
        coldest, hottest = self.kT
        if hottest == np.inf:
            return "unbounded, since noise drives a motion that is not damped"
        if hottest - coldest <= MATCH * hottest:
            return f"kT = {hottest:.4g} J"
        return f"not uniform, kT from {coldest:.4g} J to {hottest:.4g} J"


@checked
def describe(model: mujoco.MjModel) -> Description:
    """Print and return which dipoles, noise and potentials of a model act, and which do not.

    Parameters
    ----------
    model : mujoco.MjModel

    Returns
    -------
    Description

    Raises
    ------
    ValueError
        The model's mark, or something that it names, is invalid.

    Examples
    --------
    >>> import magmotor as mm
    >>> found = mm.describe(mm.build(mm.Motor()))
    acting: dipoles, couplings and noise, inside magmotor.magnetism()
    dipoles: ball 1, inner_ring 20, outer_ring 5
    pairs: ball and inner_ring (times 2), ball and outer_ring, inner_ring and outer_ring
    noise, Brownian wrenches: ball 2, inner_ring 3
    temperature: kT = 3.333e-06 J
    """
    kinds = acting_forces(model)
    acting = tuple(word for word, bit in WORDS.items() if word != "all" and kinds & bit)
    bodies = _dipoles(model) if "dipoles" in acting else {}
    kT, unknown = _temperatures(model) if "noise" in acting else (None, "")
    found = Description(
        acting=acting,
        marked=not kinds & UNMARKED,
        plugin=_has_plugin(model),
        dipoles={_name(model, "body", body): count for body, count in bodies.items()},
        pairs=_pairs(model, [*bodies]),
        noise=_rows(model) if "noise" in acting else {},
        potentials=_waves(model) if "potentials" in acting else {},
        kT=kT,
        unknown=unknown,
        idle=tuple(_idle(model, acting, bool(kinds & UNMARKED))),
    )
    print(found)
    return found


def _name(model: mujoco.MjModel, kind: str, number: int) -> str:
    """Return the name of an element; without one, its kind and number."""
    name = mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), number)
    return name or f"{kind} {number}"


def _listed(entries: Iterable[str]) -> str:
    entries = [*entries]
    more = [f"and {len(entries) - LISTED} more"] if len(entries) > LISTED else []
    return ", ".join(entries[:LISTED] + more)


def _joined(words: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def _has_plugin(model: mujoco.MjModel) -> bool:
    return bool((model.plugin == magmotor_plugin.register()).any())


def _dipoles(model: mujoco.MjModel) -> dict[int, int]:
    """Return the number of dipoles by body."""
    sites = np.flatnonzero(model.site_user[:, 0]) if model.nuser_site else []
    return dict(sorted(Counter(model.site_bodyid[sites].tolist()).items()))


def _pairs(model: mujoco.MjModel, bodies: list[int]) -> dict[tuple[str, str], float]:
    """Return the factors of all pairs of bodies whose dipoles act on each other."""
    factors = coupling_factors(model)
    pairs = {pair: factors(*pair) for pair in combinations(bodies, 2)}
    return {
        (_name(model, "body", one), _name(model, "body", other)): factor
        for (one, other), factor in pairs.items()
        if factor
    }


def _rows(model: mujoco.MjModel) -> dict[str, Array]:
    """Return the Brownian wrenches by body."""
    rows = model.body_user[:, : model.nuser_body // 6 * 6].reshape(model.nbody, -1, 6)
    return {
        _name(model, "body", body): wrenches[wrenches.any(axis=1)]
        for body, wrenches in enumerate(rows)
        if wrenches.any()
    }


def _waves(model: mujoco.MjModel) -> dict[str, Array]:
    """Return the Fourier coefficients by joint, without the zeros with which MuJoCo pads them."""
    found = {}
    for joint, row in enumerate(model.jnt_user):
        terms = (len(np.trim_zeros(row, "b")) + 1) // 2
        if terms:
            found[_name(model, "joint", joint)] = row[: 2 * terms].copy()
    return found


def _temperatures(model: mujoco.MjModel) -> tuple[tuple[float, float] | None, str]:
    """Return the extreme temperatures kT; None and a reason if they are unknown."""
    try:
        langevin = langevin_model(model)
        damping, noise = langevin.damping, langevin.noise
    except ValueError:
        if others := [*_other_dampers(model)]:
            return None, f"{_joined(others)} may damp"
        damping, noise = joint_damping(model), _noise(model)
    if not noise.any():
        return None, "noise drives no joint"
    return _extremes(damping, noise @ noise.T / 2), ""


def _noise(model: mujoco.MjModel) -> Array:
    """Return the generalized forces (nv, rows) of all Brownian wrenches at `qpos0`."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    jacobian = np.empty((6, model.nv))
    channels = []
    for body, row in enumerate(model.body_user[:, : model.nuser_body // 6 * 6]):
        mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], body)
        channels.append(row.reshape(-1, 6) @ jacobian)
    return np.vstack(channels).T


def _extremes(damping: Array, drive: Array) -> tuple[float, float]:
    """Return the extreme temperatures kT of all directions of velocity, damped or driven."""
    scale = np.sqrt(np.diag(damping))
    damped = scale > 0
    if np.diag(drive)[~damped].any():
        return 0.0, np.inf
    scaled = damping[np.ix_(damped, damped)] / np.outer(scale[damped], scale[damped])
    driven = drive[np.ix_(damped, damped)] / np.outer(scale[damped], scale[damped])
    rates, directions = np.linalg.eigh(scaled)
    free = rates < MATCH
    if (directions[:, free].T @ driven @ directions[:, free] > MATCH * driven.max()).any():
        return 0.0, np.inf
    whitened = directions[:, ~free] / np.sqrt(rates[~free])
    temperatures = np.linalg.eigvalsh(whitened.T @ driven @ whitened)
    return max(0.0, float(temperatures[0])), float(temperatures[-1])


def _other_dampers(model: mujoco.MjModel) -> Iterator[str]:
    """Yield what may damp besides the linear damping of joints and fixed tendons."""

    def acts(flag: str, *fields: NDArray[Any]) -> bool:
        return not disabled(model, flag) and any(field.any() for field in fields)

    fixed = model.wrap_type[model.tendon_adr] == int(mujoco.mjtWrap.mjWRAP_JOINT)
    collide = model.npair + model.nflex > 0 or len(colliding_geoms(model)) > 0
    passive = not (disabled(model, "spring") and disabled(model, "damper"))
    present = {
        "actuators": acts("actuation", _velocity_dependent_actuators(model))
        or acts("damper", model.actuator_damping, model.actuator_dampingpoly),
        "polynomial damping": acts("damper", model.dof_dampingpoly, model.tendon_dampingpoly),
        "spatial tendons": acts("damper", model.tendon_damping[~fixed]),
        "friction loss": acts("frictionloss", model.dof_frictionloss, model.tendon_frictionloss),
        "limits": acts("limit", model.jnt_limited, model.tendon_limited),
        "equalities": acts("equality", model.eq_active0),
        "contacts": collide and not disabled(model, "contact"),
        "flexes": passive and model.nflex > 0,
        "a fluid": passive and (model.opt.density > 0 or model.opt.viscosity > 0),
        "plugins": bool((model.plugin != magmotor_plugin.register()).any()),
    }
    return (name for name, exists in present.items() if exists)


def _velocity_dependent_actuators(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Whether the force of each actuator may depend on velocities, shape (nactuator,)."""
    affine = int(mujoco.mjtGain.mjGAIN_AFFINE)  # like mjBIAS_AFFINE; only constants are below it
    other = (model.actuator_gaintype > affine) | (model.actuator_biastype > affine)
    return other | (model.actuator_gainprm[:, 2] != 0) | (model.actuator_biasprm[:, 2] != 0)


def _idle(model: mujoco.MjModel, acting: tuple[str, ...], unmarked: bool) -> Iterator[str]:
    """Yield what does not act, and why."""
    present = {
        "dipoles": ("user numbers of sites", bool(model.nuser_site and model.site_user.any())),
        "couplings": (
            "tuples named coupling...",
            any(model.tuple(k).name.startswith("coupling") for k in range(model.ntuple)),
        ),
        "noise": ("user numbers of bodies", bool(model.nuser_body and model.body_user.any())),
        "potentials": ("user numbers of joints", bool(model.nuser_jnt and model.jnt_user.any())),
    }
    for word, (what, exists) in present.items():
        if exists and word not in acting:
            reason = "there is no mark" if unmarked else f"the mark does not name {word}"
            yield f"{what}, since {reason}"
    if not any(exists for _, exists in present.values()):
        yield 'sites without user numbers (a dipole has user="MOMENT", in A m^2)'
    yield from _idle_dipoles(model) if "dipoles" in acting else ()
    if not _has_plugin(model):
        if disabled(model, "actuation"):
            yield "magnetism(), since MuJoCo skips it while the flag actuation is disabled"
        return
    if (model.plugin == magmotor_plugin.register()).sum() > 1:
        yield "further instances of magmotor.forces, since the first one acts on the whole model"
    if disabled(model, "spring") and disabled(model, "damper"):
        yield "magmotor.forces, since MuJoCo skips it if flags spring and damper are both disabled"
    if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP:
        yield "magmotor.forces on sleeping bodies, which it does not wake"


def _idle_dipoles(model: mujoco.MjModel) -> Iterator[str]:
    bodies = [*_dipoles(model)]
    welds = {int(model.body_weldid[body]) for body in bodies}
    if len(welds) == 1:
        yield "the dipoles, since all are on one rigid body"
    elif not any(model.body_dofnum[weld] for weld in welds):
        yield "the dipoles, since none of their bodies can move"
    elif not _pairs(model, bodies):
        yield "the dipoles, since couplings switch all pairs off (prm is 0, the default)"
