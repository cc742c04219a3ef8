"""The rule for contacts of magnets: how stiff a soft contact must be to hold what attracts.

Two magnets at the distance d, of the reduced mass m, attract each other with the force F. Their
own time is T = sqrt(d m/F). MuJoCo's contact pushes back with the force of a spring that leaves a
penetration x d, where

    x (1 - x)^4 = c (s/T)^2,        c = cone dmax^2 (1 - D)/D^2,

s is the contact's time constant times its damping ratio, D is its impedance, and `cone` is 1 but
for pyramidal friction cones. The left-hand side is at most 0.082 (at x = 1/5): a softer contact
cannot hold the magnets, whose force grows as 1/d^4. See docs/contact.md.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.lookup import disabled, label

SHORTEST = 2.0
"""Shortest time constant in timesteps, MuJoCo's own limit refsafe."""

SUNK, STRUCK = 0.05, 0.25
"""Largest penetration at rest, and of magnets that fall from far away.

The unit is the smaller depth of a dipole below its surface, the radius of a sphere.
"""

FALL = 0.82
"""Speed at touch of magnets that fall from far away, sqrt(2/3), over d/T."""

RESTS = np.linspace(0, 1, 1001)[1:-1]
"""Penetrations over the distance at touch at which push and pull are compared."""


SLACK = 1 + 1e-6
"""Rounding allowed in comparisons with limits."""


class Approach(NamedTuple):
    """The closest approach of two magnets that their geoms allow."""

    distance: float
    """At touch, in m: four times the force over its gradient."""
    force: float
    """In N; but on planes, as if all moments were aligned, since impacts are off center."""
    mass: float
    """Reduced mass that MuJoCo assumes where it makes a contact soft, in kg."""
    least_mass: float
    """That of the two bodies alone, in kg: joints and what hangs on them only add inertia."""
    depth: float
    """The smaller depth of a dipole below its surface, in m, unless it is at the surface."""
    contacts: float = 1.0
    """Number of equal contacts that share the force."""
    pull: float = math.nan
    """The model's largest force in the poses examined, in N."""

    @property
    def time(self) -> float:
        """Time of the magnets' own motion in the contact, in s."""
        return math.sqrt(self.distance * self.mass / self.force)

    @property
    def fall_time(self) -> float:
        """Least time of the magnets' own motion before they touch, in s."""
        return math.sqrt(self.distance * self.least_mass / self.force)


class Softness(NamedTuple):
    """Parameters of the contact of two geoms, as MuJoCo mixes them."""

    solref: Array
    solimp: Array
    cone: float
    """Factor of the regularization, which the friction cone changes."""

    def stiffness_time(self, shortest: float) -> float:
        """Return the time constant times the damping ratio, in s; MuJoCo lengthens a short one."""
        first, second = self.solref
        return max(first, shortest) * second if first > 0 else 1 / math.sqrt(max(-first, 1e-30))

    def resolved_time(self, shortest: float) -> float:
        """Return the shorter one of the times of spring and damper, in s."""
        first, second = self.solref
        damping = max(first, shortest) if first > 0 else 2 / max(-second, 1e-30)
        return min(self.stiffness_time(shortest), damping)

    @property
    def ratio(self) -> float:
        """Damping ratio."""
        first, second = self.solref
        return second if first > 0 else -second / 2 / math.sqrt(max(-first, 1e-30))

    def strike(self) -> float:
        """Return how deep a speed v drives the contact, over v s; less if it is overdamped."""
        ratio = min(self.ratio, 1 - 1e-9)
        return math.exp(-ratio * math.acos(ratio) / math.sqrt(1 - ratio**2))

    def compliance(self, depth: Array) -> Array:
        """Return c, the compliance in units of (s/T)^2, at penetrations in m."""
        impedance = self.impedance(depth)
        return self.cone * self.solimp[1] ** 2 * (1 - impedance) / impedance**2

    def impedance(self, depth: Array) -> Array:
        """Return MuJoCo's impedance at penetrations in m."""
        least, largest, width, midpoint, power = self.solimp
        x = np.clip(depth / width, 0, 1) if width > 1e-15 else np.full_like(depth, 0.5)
        rise = np.where(
            x <= midpoint,
            x**power / midpoint ** (power - 1),
            1 - (1 - x) ** power / (1 - midpoint) ** (power - 1),
        )
        return least + (rise if width > 1e-15 else 0.5) * (largest - least)


def softness(model: mujoco.MjModel, one: int, other: int, pair: int = -1) -> Softness:
    """Return what MuJoCo makes of the parameters of two geoms, or of a contact pair."""
    m, both = model, [one, other]
    if pair >= 0:
        solref, solimp = m.pair_solref[pair], m.pair_solimp[pair]
        friction, dimension = m.pair_friction[pair, 0], m.pair_dim[pair]
    elif m.geom_priority[one] != m.geom_priority[other]:
        first = both[int(m.geom_priority[other] > m.geom_priority[one])]
        solref, solimp = m.geom_solref[first], m.geom_solimp[first]
        friction, dimension = m.geom_friction[first, 0], m.geom_condim[first]
    else:
        weight = m.geom_solmix[both] * (m.geom_solmix[both] >= mujoco.mjMINVAL)
        weight = weight / weight.sum() if weight.any() else np.full(2, 0.5)
        standard = (m.geom_solref[both, 0] > 0).all()
        solref = weight @ m.geom_solref[both] if standard else m.geom_solref[both].min(axis=0)
        solimp = weight @ m.geom_solimp[both]
        friction, dimension = m.geom_friction[both, 0].max(), m.geom_condim[both].max()
    if m.opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
        solref, solimp, friction = m.opt.o_solref, m.opt.o_solimp, m.opt.o_friction[0]
    cone = 1.0
    if dimension > 1 and m.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL:
        cone = friction**2 / m.opt.impratio * (1 + friction**2) / (dimension - 1)
    return softness_of(solref, solimp, float(cone))


def softness_of(solref: Array, solimp: Array, cone: float = 1.0) -> Softness:
    """Return the numbers of a constraint, within the bounds that MuJoCo keeps."""
    if (solref[0] > 0) != (solref[1] > 0):  # MuJoCo replaces a mixture of both formats
        solref = np.array([0.02, 1.0])
    limited = np.array(solimp)
    limited[[0, 1, 3]] = np.clip(limited[[0, 1, 3]], mujoco.mjMINIMP, mujoco.mjMAXIMP)
    limited[2], limited[4] = max(0, limited[2]), max(1, limited[4])
    return Softness(np.array(solref), limited, cone)


def longest_time_constant(approach: Approach, contact: Softness) -> float:
    """Return the longest time constant s of a contact that holds two magnets, in s.

    The timestep is at most half of it.
    """
    sunk = min(SUNK * approach.depth / approach.distance, 0.2)
    compliance = float(contact.compliance(np.array(sunk * approach.distance)))
    at_rest = math.sqrt(sunk * (1 - sunk) ** 4 / max(compliance, 1e-12))
    deepest = FALL * max(contact.strike(), 1 / SHORTEST)
    at_impact = STRUCK * approach.depth / approach.distance / deepest
    return min(at_rest * approach.time, at_impact * approach.fall_time)


def penetration_at_rest(approach: Approach, contact: Softness, constant: float) -> float:
    """Return the penetration at rest over the distance; infinite if the contact cannot hold them.

    `constant` is s, in s.
    """
    push = RESTS * (1 - RESTS) ** 4
    pull = contact.compliance(RESTS * approach.distance) * (constant / approach.time) ** 2
    holds = push >= pull
    return float(RESTS[holds.argmax()]) if holds.any() else math.inf


def shortest_kept(model: mujoco.MjModel, timestep: float) -> float:
    """Return the shortest time constant that MuJoCo keeps as it is, in s."""
    return 0.0 if disabled(model, "refsafe") else SHORTEST * timestep


def owners_of(model: mujoco.MjModel, touching: NDArray[np.int64]) -> tuple[tuple[str, Array], ...]:
    """Return what holds `solref` of contacts: names, and views of the model's numbers.

    `touching` has rows of two geoms and a contact pair, or -1.
    """
    if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
        return (("option o_solref", model.opt.o_solref),)
    pairs = np.unique(touching[touching[:, 2] >= 0, 2])
    both = touching[touching[:, 2] < 0, :2]
    priority = model.geom_priority[both]
    geoms = np.unique(both[priority >= priority[:, ::-1]])
    found = [(label(model, "pair", pair), model.pair_solref[pair]) for pair in pairs]
    return (*found, *((label(model, "geom", geom), model.geom_solref[geom]) for geom in geoms))
