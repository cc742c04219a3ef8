"""What of a model can be switched off or reduced, in the terms of MJCF."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import DIPOLES
from magmotor.mjcf.declared import name_of
from magmotor.mjcf.lookup import disabled, number_of
from magmotor_plugin import slots

Numbers = NDArray[np.integer]

OPTIONS = (
    "disableflags", "enableflags", "solver", "iterations", "ls_iterations", "tolerance",
    "noslip_iterations", "jacobian", "cone", "density", "viscosity",
)  # fmt: skip
"""Members of `model.opt` that features change."""

ARRAYS = (
    "geom_condim", "pair_dim", "flex_condim", "geom_contype", "geom_conaffinity", "body_contype",
    "body_conaffinity", "cam_mode", "light_mode", "site_user", "numeric_data",
)  # fmt: skip
"""Arrays of a model that features change."""

CONSTRAINT, CONTACT = 'flag constraint="disable"', 'flag contact="disable"'

BY_CONSTRAINT, BY_CONTACT = frozenset({CONSTRAINT}), frozenset({CONSTRAINT, CONTACT})
"""What includes all features of constraints, and all of contacts."""

WITHIN = {
    **dict.fromkeys(("equality", "frictionloss", "limit", "contact", "island"), BY_CONSTRAINT),
    **dict.fromkeys(("midphase", "nativeccd", "multiccd"), BY_CONTACT),
    "eulerdamp": frozenset({'flag damper="disable"'}),
}
"""Larger changes, by the flags that they include or make irrelevant."""

LEVELS = {"iterations": (10, 3, 1), "ls_iterations": (10, 3)}
"""Options of the solver, and the values to which they are reduced."""

SOLVER_TOLERANCE = 1e-4
"""Tolerance to which that of the solver is raised."""

LARGEST_TOLERANCE = 0.1
"""Largest tolerance of the forces between dipoles that a model may declare."""

STIFF = (
    "jnt_stiffness", "jnt_stiffnesspoly", "tendon_stiffness", "tendon_stiffnesspoly",
    "flex_stiffness", "flex_edgestiffness", "flex_bending",
)  # fmt: skip

DAMPED = (
    "dof_damping", "dof_dampingpoly", "tendon_damping", "tendon_dampingpoly", "actuator_damping",
    "actuator_dampingpoly", "flex_damping", "flex_edgedamping",
)  # fmt: skip


class Seen(NamedTuple):
    """What happened along a path."""

    touched: NDArray[np.bool_]
    """Whether each geom was ever part of a contact."""
    constrained: bool
    """Whether the solver ever had a constraint."""


@dataclass(frozen=True)
class Feature:
    """A change of a model that may save time."""

    what: str
    """The change in the terms of MJCF."""
    apply: Callable[[mujoco.MjModel], object]
    within: frozenset[str] = frozenset()
    """Larger changes, any of which includes this one or makes it irrelevant."""
    names: tuple[str, ...] = ()
    """The elements that change, if these are not all of their kind."""


def switch_off(off: Sequence[Feature], model: mujoco.MjModel, own: mujoco.MjModel) -> None:
    """Make a model what its unchanged copy becomes without some features."""
    for name in OPTIONS:
        setattr(model.opt, name, getattr(own.opt, name))
    for name in ARRAYS:
        getattr(model, name)[:] = getattr(own, name)
    for feature in off:
        feature.apply(model)


def features(model: mujoco.MjModel, seen: Seen) -> Iterator[Feature]:
    """Yield what can be switched off or reduced in a model; a smaller change precedes a larger one.

    The flags for all constraints and for all contacts are exceptions. The strengths of dipoles are
    left to `weakest`. List all of them before the model changes, since they are read from it.
    """
    touching = bool(model.npair) or _any(model, "geom_contype", "flex_contype")
    may_touch = touching and not disabled(model, "contact")
    yield from _flags(model, seen, may_touch)
    if seen.constrained:
        yield from _solver(model)
    if seen.touched.any():
        yield from _contacts(model, seen)
    idle = ~seen.touched & ((model.geom_contype | model.geom_conaffinity) != 0)
    if may_touch and idle.any():
        geoms = np.flatnonzero(idle)
        yield Feature(
            f'geom contype="0" conaffinity="0" where nothing touches ({len(geoms)})',
            partial(_let_through, geoms),
            BY_CONTACT,
            tuple(name_of(model, "geom", geom) for geom in geoms.tolist()),
        )
    if model.opt.density or model.opt.viscosity:
        yield Feature('option density="0" viscosity="0"', _empty)
    for kind, mode in (("camera", "cam_mode"), ("light", "light_mode")):
        if _any(model, mode):
            yield Feature(f'{kind} mode="fixed"', partial(_fill, mode))
    yield from _tolerance(model)


def dipoles(model: mujoco.MjModel) -> Numbers:
    """Return the sites that act as dipoles, the weakest first."""
    if not model.nuser_site or not model.site_user.any():
        return np.empty(0, int)
    by_plugin = (model.plugin == slots.register()).any()
    if not (by_plugin or mujoco.get_mjcb_control()) or not acting_forces(model) & DIPOLES:
        return np.empty(0, int)
    strength = np.abs(model.site_user[:, 0])
    order = np.argsort(strength, kind="stable")
    return order[strength[order] > 0]


def weakest(model: mujoco.MjModel, sites: Numbers) -> Feature:
    """Return the removal of the weakest dipoles, which are at these sites."""
    names = tuple(name_of(model, "site", site) for site in sites.tolist())
    return Feature(
        f'site user="0" at the weakest dipoles ({len(sites)})', partial(_demagnetize, sites),
        names=names,
    )  # fmt: skip


def _flags(model: mujoco.MjModel, seen: Seen, may_touch: bool) -> Iterator[Feature]:
    """Yield the flags that do something in a model."""
    damped = _any(model, *DAMPED)
    limits = {
        "equality": model.neq > 0,
        "frictionloss": _any(model, "dof_frictionloss", "tendon_frictionloss"),
        "limit": _any(model, "jnt_limited", "tendon_limited"),
    }
    limiting = any(has and not disabled(model, name) for name, has in limits.items())
    acting = {
        "constraint": may_touch or limiting,
        **limits,
        **dict.fromkeys(("contact", "midphase", "nativeccd", "multiccd"), may_touch),
        "island": seen.constrained,
        "spring": _any(model, *STIFF),
        "damper": damped,
        "eulerdamp": damped and model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER,
        "gravity": model.opt.gravity.any(),
        "actuation": model.nu > 0,
        "sensor": model.nsensor > 0,
    }
    bits = mujoco.mjtDisableBit.__members__
    for name, acts in acting.items():
        bit = int(bits.get(f"mjDSBL_{name.upper()}", 0))
        if acts and bit and not disabled(model, name):
            within = WITHIN.get(name, frozenset())
            yield Feature(f'flag {name}="disable"', partial(_disable, bit), within)
    for member, bit in mujoco.mjtEnableBit.__members__.items():
        if member.startswith("mjENBL_") and model.opt.enableflags & bit:
            name = member.removeprefix("mjENBL_").lower()
            yield Feature(f'flag {name}="disable"', partial(_no_longer_enable, int(bit)))


def _solver(model: mujoco.MjModel) -> Iterator[Feature]:
    opt = model.opt
    newton = opt.solver == mujoco.mjtSolver.mjSOL_NEWTON
    other = mujoco.mjtSolver.mjSOL_CG if newton else mujoco.mjtSolver.mjSOL_NEWTON
    yield _option("solver", int(other), "CG" if newton else "Newton")
    for name, levels in LEVELS.items():
        fewer = [value for value in levels if value < getattr(opt, name)]
        yield from _successive([_option(name, value, str(value)) for value in fewer])
    if opt.tolerance < SOLVER_TOLERANCE:
        yield _option("tolerance", SOLVER_TOLERANCE, f"{SOLVER_TOLERANCE:g}")
    if opt.noslip_iterations:
        yield _option("noslip_iterations", 0, "0")
    sparse = bool(mujoco.mj_isSparse(model))
    jacobian = mujoco.mjtJacobian.mjJAC_DENSE if sparse else mujoco.mjtJacobian.mjJAC_SPARSE
    yield _option("jacobian", int(jacobian), "dense" if sparse else "sparse")


def _contacts(model: mujoco.MjModel, seen: Seen) -> Iterator[Feature]:
    if model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC:
        yield _option("cone", int(mujoco.mjtCone.mjCONE_PYRAMIDAL), "pyramidal", BY_CONTACT)
    most = max(model.geom_condim[seen.touched].max(), model.pair_dim.max(initial=1))
    levels = [value for value in (3, 1) if value < most]
    yield from _successive([
        Feature(f'geom condim="{value}"', partial(_limit_condim, value), BY_CONTACT)
        for value in levels
    ])  # fmt: skip


def _tolerance(model: mujoco.MjModel) -> Iterator[Feature]:
    """Yield a tenfold tolerance of the forces between dipoles, if the model declares one."""
    k = number_of(model, "numeric", "magnetic_tolerance")
    if k >= 0 and dipoles(model).size:
        where = int(model.numeric_adr[k])
        value = min(10 * float(model.numeric_data[where]), LARGEST_TOLERANCE)
        if value > model.numeric_data[where]:
            what = f'numeric name="magnetic_tolerance" data="{value:g}"'
            yield Feature(what, partial(_put, where, value))


def _successive(levels: Sequence[Feature]) -> Iterator[Feature]:
    """Yield changes, each of which is within the next ones."""
    for k, level in enumerate(levels):
        larger = {feature.what for feature in levels[k + 1 :]}
        yield Feature(level.what, level.apply, level.within | larger)


def _option(name: str, value: float, shown: str, within: frozenset[str] = BY_CONSTRAINT) -> Feature:
    return Feature(f'option {name}="{shown}"', partial(_choose, name, value), within)


def _any(model: mujoco.MjModel, *names: str) -> bool:
    """Whether any number of these arrays is not zero; some versions of MuJoCo lack some arrays."""
    return any(np.any(getattr(model, name, 0)) for name in names)


def _choose(name: str, value: float, model: mujoco.MjModel) -> None:
    setattr(model.opt, name, value)


def _disable(bit: int, model: mujoco.MjModel) -> None:
    model.opt.disableflags |= bit


def _no_longer_enable(bit: int, model: mujoco.MjModel) -> None:
    model.opt.enableflags &= ~bit


def _empty(model: mujoco.MjModel) -> None:
    model.opt.density = model.opt.viscosity = 0.0


def _fill(name: str, model: mujoco.MjModel) -> None:
    getattr(model, name)[:] = 0


def _put(where: int, value: float, model: mujoco.MjModel) -> None:
    model.numeric_data[where] = value


def _demagnetize(sites: Numbers, model: mujoco.MjModel) -> None:
    model.site_user[sites] = 0.0


def _limit_condim(value: int, model: mujoco.MjModel) -> None:
    for condim in (model.geom_condim, model.pair_dim, model.flex_condim):
        np.minimum(condim, value, out=condim)


def _let_through(geoms: Numbers, model: mujoco.MjModel) -> None:
    """Exclude geoms from collisions, and bodies all of whose geoms are excluded."""
    for mask, union in (
        (model.geom_contype, model.body_contype), (model.geom_conaffinity, model.body_conaffinity),
    ):  # fmt: skip
        mask[geoms] = 0
        union[:] = 0
        np.bitwise_or.at(union, model.geom_bodyid, mask)
