"""`describe`: which forces act on a model, at which temperature, and what does not act and why."""

import sys
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import mujoco
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import UNMARKED, WORDS
from magmotor.mjcf.declarations.table import COILS, FIELDS
from magmotor.mjcf.declared import (
    can_move,
    dipole_counts,
    has_plugin,
    name_of,
    site_moments,
    with_kind,
)
from magmotor.mjcf.field_and_energy import coupling_factors
from magmotor.mjcf.langevin.dry_friction import dry_joints
from magmotor.mjcf.langevin.temperature import MATCH, joined, temperatures
from magmotor.mjcf.not_acting import LISTED, idle_elements, listed
from magmotor.mjcf.unit_system import OF_NEODYMIUM, OTHERS, declares_units, doubts, own_units
from magmotor_plugin import slots

HUGE = 1e3
"""From which moment in A m^2 a site has it by mistake."""

FORCES = slots.FORCES.decode()

ENGINES = {
    "mujoco.mjx": "MJX, which cannot run the forces of magmotor",
    "mujoco_warp": "MuJoCo Warp, unless magmotor.warp.put_model makes its model",
}
"""Modules of other engines for MuJoCo's models, and what to say of them."""

OF_PLANETS = 1e15
"""From which moment in A m^2 a site that cannot move stands for a planet."""


@dataclass(frozen=True)
class Description:
    """What acts on a model, as text for `print`.

    Attributes
    ----------
    acting : tuple of str
        Those of `dipoles`, `couplings`, `noise`, `potentials`, `fields`, `coils`, `iron`,
        `magnets`, `conductors` and `hysteresis` that act on the model.
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
        `qpos0` and, on trees, in eight random configurations; equal if all have the same; infinite
        where nothing damps. None if it is unknown.
    mismatch : float
        The largest difference of noise/kT and damping there, over the largest damping, with the kT
        that fits best; zero if the noise is that of one temperature, or if it is unknown.
    unknown : str
        Why the temperature is unknown, if there is noise.
    potentials : dict of str to ndarray
        Fourier coefficients a_1 b_1 a_2 b_2 ... in J of each joint that has any.
    fields : dict of str to str
        What each applied field is, by the name of its numeric.
    coils : dict of str to (str, int)
        The actuator and the number of dipoles and geoms of each coil, by the name of its tuple.
    pushing : tuple of str
        Actuators of coils and fields that also push, by their own gain or bias.
    iron : dict of str to float
        Susceptibility of each geom that is iron.
    magnets : dict of str to float
        Polarization in T of each geom that is a magnet.
    conductors : dict of str to (float, float)
        Conductivity in S/m and thickness in m, 0 for a half-space, of each plane of a conductor.
    hysteresis : dict of str to (float, float)
        Coercivity in A/m, and remanence over saturation, of each site with hysteresis.
    magnetometers : dict of str to str
        The site of each magnetometer, by the name of the sensor.
    dry_friction : tuple of str
        Joints and tendons with dry friction, with which noise leaves the model too cold.
    huge : dict of str to float
        Moments in A m^2 that are probably mistakes, by site.
    units : tuple of str
        What the units in the text stand for, if the model's are not those of SI; or why its numbers
        seem to be in other units, although it declares no `magnetic_constant`.
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
    mismatch: float
    unknown: str
    potentials: dict[str, Array]
    fields: dict[str, str]
    coils: dict[str, tuple[str, int]]
    pushing: tuple[str, ...]
    iron: dict[str, float]
    magnets: dict[str, float]
    conductors: dict[str, tuple[float, float]]
    hysteresis: dict[str, tuple[float, float]]
    magnetometers: dict[str, str]
    dry_friction: tuple[str, ...]
    huge: dict[str, float]
    units: tuple[str, ...]
    idle: tuple[str, ...]

    def __repr__(self) -> str:
        """Return one line for each kind of force, and for each reason why something is idle."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        where = "by the plugin magmotor.forces" if self.plugin else "inside magmotor.magnetism()"
        acting = joined(self.acting)
        unmarked = "" if self.marked or not self.acting else "; the model has no mark"
        yield f"acting: {f'{acting}, {where}' if acting else 'nothing'}{unmarked}"
        if self.dipoles:
            parts = (f"{count} on {body}" for body, count in self.dipoles.items())
            yield f"dipoles: {listed(parts)}"
        for site, moment in self.huge.items():
            yield f"{with_kind('site', site)} has {moment:g} A m^2, {weighed(moment)} {OTHERS}"
        yield from self.units
        if self.pairs:
            pairs = (
                f"{one} and {other}" + (f" (times {factor:g})" if factor != 1 else "")
                for (one, other), factor in self.pairs.items()
            )
            yield f"pairs: {listed(pairs)}"
        if self.fields:
            yield f"fields: {listed(f'{name} ({what})' for name, what in self.fields.items())}"
        if self.coils:
            parts = (f"{name} ({n}, {by})" for name, (by, n) in self.coils.items())
            yield f"coils, magnets and actuator: {listed(parts)}"
        if self.pushing:
            what = 'that also push bodies (gainprm="0" prevents this)'
            yield f"actuators of coils and fields {what}: {listed(self.pushing)}"
        yield from self._elements()
        if self.noise:
            rows = (f"{body} {len(wrenches)}" for body, wrenches in self.noise.items())
            yield f"noise, Brownian wrenches: {listed(rows)}"
            yield f"temperature: {self._temperature()}"
        if self.potentials:
            terms = (f"{joint} {len(waves) // 2}" for joint, waves in self.potentials.items())
            yield f"periodic potentials, Fourier terms: {listed(terms)}"
        if self.dry_friction:
            yield f"dry friction, which has no matching noise: {listed(self.dry_friction)}"
        yield from (f"not acting: {reason}" for reason in self.idle)
        yield from (f"not acting: {reason}" for reason in elsewhere(self))

    def _elements(self) -> Iterator[str]:
        """Yield what there is besides dipoles, fields and coils."""
        parts = {
            "iron, susceptibilities": [f"{name} {value:g}" for name, value in self.iron.items()],
            "magnets, polarizations": [
                f"{name} {value:g} T" for name, value in self.magnets.items()
            ],
            "conductors": [
                f"{name} {value:g} S/m" + (f" {thickness:g} m thick" if thickness else "")
                for name, (value, thickness) in self.conductors.items()
            ],
            "hysteresis": [
                f"{name} {coercivity:g} A/m, remanence {remanence:g} of saturation"
                for name, (coercivity, remanence) in self.hysteresis.items()
            ],
            "magnetometers": [f"{name} at {site}" for name, site in self.magnetometers.items()],
        }
        yield from (f"{what}: {listed(found)}" for what, found in parts.items() if found)

    def _temperature(self) -> str:
        if self.kT is None:
            return f"unknown, since {self.unknown}"
        coldest, hottest = self.kT
        if hottest == np.inf:
            return "unbounded, since noise drives a motion that is not damped"
        if hottest - coldest <= MATCH * hottest:
            return f"kT = {hottest:.4g} J"
        return (
            f"not uniform, kT from {coldest:.4g} J to {hottest:.4g} J, since noise and damping"
            f" differ by {100 * self.mismatch:.2g} %"
        )


@checked(finite=False)
def describe(model: mujoco.MjModel) -> Description:
    """Return which of magmotor's forces act on a model, and what does not act and why.

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
    >>> print(mm.describe(mm.build(mm.Motor())))  # doctest: +ELLIPSIS
    acting: dipoles, couplings and noise, inside magmotor.magnetism()
    dipoles: 1 on ball, 20 on inner_ring, 5 on outer_ring
    pairs: ball and inner_ring (times 2), ball and outer_ring, inner_ring and outer_ring
    noise, Brownian wrenches: ball 2, inner_ring 3
    temperature: kT = 3.333e-06 J
    not acting: dipoles, couplings and noise outside of magmotor.magnetism(), since the model ...
    """
    kinds = acting_forces(model)
    named = [word for word, bit in WORDS.items() if word != "all" and kinds & bit]
    bodies = dipole_counts(model) if "dipoles" in named else {}
    fields = declared.fields(model) if "fields" in named else {}
    iron = declared.iron(model) if "iron" in named else {}
    magnetized = [geom for geom, susceptibility in iron.items() if susceptibility]
    shapes = declared.polarizations(model) if "magnets" in named else {}
    magnets = {*bodies, *model.geom_bodyid[[*magnetized, *shapes]].tolist()}
    pairs = _pairs(model, sorted(magnets))
    owners = declared.field_owners(model) if "fields" in named else set()
    conductors = declared.conductors(model) if "conductors" in named else {}
    braked = bool(conductors) and any(can_move(model, body) for body in magnets)
    acting = bool(pairs or braked or _meets(model, magnets, owners, magnetized))
    noise = _rows(model) if "noise" in named else {}
    potentials = _waves(model) if "potentials" in named else {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the plugin, which says the same as `idle`
        kT, mismatch, unknown = temperatures(model) if noise else (None, 0.0, "")
    huge = _huge(model) if "dipoles" in named and not declares_units(model) else {}
    moments = site_moments(model) if "dipoles" in named else np.zeros(model.nsite)
    loops = declared.hysteresis(model) if "hysteresis" in named else {}
    acts = {
        "dipoles": bodies and acting,
        "couplings": pairs and "couplings" in named and declared.couplings(model),
        "noise": noise,
        "potentials": potentials,
        "fields": fields and acting,
        "coils": "coils" in named and acting and declared.coils(model),
        "iron": magnetized and acting,
        "magnets": shapes and acting,
        "conductors": braked,
        "hysteresis": loops and "dipoles" in named and acting,
    }
    return Description(
        acting=tuple(word for word, exists in acts.items() if exists),
        marked=not kinds & UNMARKED,
        plugin=has_plugin(model),
        dipoles={name_of(model, "body", body): count for body, count in bodies.items()},
        pairs=pairs,
        noise=noise,
        potentials=potentials,
        fields=fields,
        coils=declared.coils(model) if "coils" in named else {},
        pushing=tuple(declared.pushing(model, _drivers(model, named))),
        iron={name_of(model, "geom", geom): value for geom, value in iron.items()},
        magnets={
            name_of(model, "geom", geom): float(np.linalg.norm(value))
            for geom, value in shapes.items()
        },
        conductors={name_of(model, "geom", geom): value for geom, value in conductors.items()},
        hysteresis={name_of(model, "site", site): value for site, value in loops.items()},
        magnetometers=declared.magnetometers(model),
        kT=kT,
        mismatch=mismatch,
        unknown=unknown,
        dry_friction=tuple(dry_joints(model)),
        huge=huge,
        units=own_units(model) or (*doubts(model, moments, magnets),),
        idle=tuple(idle_elements(model, named, bool(kinds & UNMARKED), acting)),
    )


def elsewhere(found: Description, *, briefly: bool = False) -> Iterator[str]:
    """Yield where the forces on a model do not act, and what to do."""
    what = joined(found.acting)
    if what and not found.plugin:
        cause = "" if found.marked else " (MjSpec.attach drops it)"
        remedy = "mm.describe(model) says how to add it" if briefly else _remedy(found.marked)
        yield (
            f"{what} outside of magmotor.magnetism(), since the model has no plugin"
            f" {FORCES}{cause}; {remedy}"
        )
    for module, engine in ENGINES.items():
        known = module == "mujoco_warp" and "magmotor.warp" in sys.modules
        if what and module in sys.modules and not known:
            yield f"{what} in {engine}"


def _remedy(marked: bool) -> str:
    """Say how to add the plugin to a model."""
    config = "" if marked else '<config key="act" value="dipoles"/>'
    return (
        f'in the file, add <extension><plugin plugin="{FORCES}"><instance name="magnets">{config}'
        f"</instance></plugin></extension>, or in Python mm.add_magnetism(spec)"
    )


def weighed(moment: float) -> str:
    """Say how much neodymium has a moment in A m^2."""
    mass = abs(moment) / OF_NEODYMIUM
    return f"the moment of {mass:.2g} kg of neodymium magnets: is the number in A m^2?"


def _drivers(model: mujoco.MjModel, named: Sequence[str]) -> list[int]:
    """Return the actuators that drive coils and fields, if these act."""
    found = declared.drivers(model, COILS) if "coils" in named else []
    found += declared.drivers(model, FIELDS) if "fields" in named else []
    return [*dict.fromkeys(found)]


def _huge(model: mujoco.MjModel) -> dict[str, float]:
    """Return moments that are probably mistakes, by site."""
    moments = site_moments(model)
    huge = [
        site
        for site in np.flatnonzero(np.abs(moments) > HUGE).tolist()
        if abs(moments[site]) <= OF_PLANETS or can_move(model, model.site_bodyid[site])
    ]
    return {name_of(model, "site", site): float(moments[site]) for site in huge[:LISTED]}


def _pairs(model: mujoco.MjModel, bodies: list[int]) -> dict[tuple[str, str], float]:
    """Return the factors of all pairs of bodies whose dipoles act on each other."""
    factor = coupling_factors(model)
    names = {body: name_of(model, "body", body) for body in bodies}
    pairs = ((one, other, factor(one, other)) for one, other in combinations(bodies, 2))
    return {(names[one], names[other]): value for one, other, value in pairs if value}


def _meets(
    model: mujoco.MjModel, bodies: Iterable[int], owners: set[int], iron: Iterable[int]
) -> bool:
    """Whether a body with dipoles or iron meets an applied field or a plane of iron, and one moves.

    `owners` are the rigid bodies to which fields are fixed.
    """
    planes = [geom for geom in iron if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE]
    moving = any(can_move(model, body) for body in bodies)
    welds = {int(model.body_weldid[body]) for body in bodies}
    met = ((owner, weld) for owner in owners for weld in welds if owner != weld)
    in_field = any(can_move(model, owner) or can_move(model, weld) for owner, weld in met)
    return in_field or bool(planes and moving)


def _rows(model: mujoco.MjModel) -> dict[str, Array]:
    """Return the Brownian wrenches of bodies that can move, by body."""
    rows = model.body_user[:, : model.nuser_body // 6 * 6].reshape(model.nbody, -1, 6)
    return {
        name_of(model, "body", body): wrenches[wrenches.any(axis=1)]
        for body, wrenches in enumerate(rows)
        if wrenches.any() and can_move(model, body)
    }


def _waves(model: mujoco.MjModel) -> dict[str, Array]:
    """Return the Fourier coefficients by joint, without the zeros with which MuJoCo pads them."""
    found = {}
    for joint, row in enumerate(model.jnt_user):
        terms = (len(np.trim_zeros(row, "b")) + 1) // 2
        if terms:
            found[name_of(model, "joint", joint)] = row[: 2 * terms].copy()
    return found
