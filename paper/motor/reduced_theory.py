r"""The motion of the motor's ball around its valley as that of a sliding disk.

Friction and noise act on the slip alone. If the ball rolls around the valley at the rate W while
its axis follows the field, nothing slips. With the axis xi = (-s, 0, u) in the directions outward,
around and up, at the distance rho, rolling requires the spin g W about xi, g = rho/(r s), so that

    P = L - (rho/(r xi_rho)) J = M W,    M = m rho^2 + J_B (1 + g^2 + 2 g u),

is conserved by slip friction and by the forces of rings that are level and have no wells; L is the
ball's angular momentum about the vertical and J that about its axis. A torque N around the valley
changes P, and it makes the ball slip: the azimuth moves with P/M + N (J_B (g + u)/(M r s))^2/c.
These are the equations of the paper's sliding disk, whose d is P. Its potential is the free energy
of the wells, and its background drag that of the ring, whose lean follows the ball.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.common.arrays import Array
from magmotor.devices.ball.landscape import aligned_force, total_field, valley
from magmotor.devices.disk.scene import Disk
from magmotor.devices.motor.scene import Motor

SECTOR_POINTS = 12
"""Azimuths in a sector at which the valley is evaluated."""

LEANS = np.linspace(-6, 6, 15)
"""Lean of the inner ring along one direction, in thermal standard deviations."""

RADII = 80
"""Distances from a quarter of the valley's radius to that of the outer ring, 1 cm apart.

The ball's thermal spread is 4 cm at alpha = 1e-3 and falls in proportion to alpha.
"""


class Rolling(NamedTuple):
    """The ball that rolls around the valley, averaged over the azimuth."""

    radius: float
    """rho, in m."""
    inertia: float
    """M, in kg m^2."""
    slip_diffusion: float
    """kT (J_B (g + u)/(M r s))^2/c, in rad^2/s, by which slip spreads the azimuth at given P."""


def rolling(scene: Motor) -> Rolling:
    """Return how the ball rolls around the valley of level rings."""
    places = valley(scene, _sector(scene, SECTOR_POINTS))
    distance = np.linalg.norm(places, axis=1)
    axis = aligned_force(scene, places)[1]
    radius = float(distance.mean())
    inward = float(-np.sum(axis[:, :2] * places, axis=1).mean() / radius)
    upward = float(axis[:, 2].mean())
    arm = scene.ball_radius * inward
    spin = radius / arm
    inertia = scene.ball_mass * radius**2 + scene.ball_inertia * (1 + spin**2 + 2 * spin * upward)
    mobility = (scene.ball_inertia * (spin + upward) / (inertia * arm)) ** 2 / scene.friction_ball
    return Rolling(radius, inertia, scene.kT * mobility)


class Wells(NamedTuple):
    """Free energy of the ball's azimuth, and the lean of the inner ring toward the ball."""

    azimuth: Array
    """In rad, over one sector."""
    free_energy: Array
    """In kT; its minimum is 0."""
    lean: Array
    """Mean angle in rad."""

    @property
    def density(self) -> Array:
        """Density of the azimuth, over its mean."""
        weight = np.exp(-self.free_energy)
        return weight / weight.mean()


@cache
def wells(scene: Motor, count: int = SECTOR_POINTS) -> Wells:
    """Integrate Gibbs' law over the ball's distance and axis and over the lean of the inner ring.

    The axis is integrated in closed form: over all directions, exp(q cos) gives sinh(q)/q with
    q = m |B|/kT. The yaw of the inner ring, which changes little, is zero.

    Parameters
    ----------
    scene : Motor
        At uniform temperature.
    count : int
        Number of azimuths.

    Returns
    -------
    Wells
    """
    azimuth = _sector(scene, count)
    distance = np.linspace(valley(scene, [0.0])[0, 0] / 4, scene.outer_radius, RADII)
    direction = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    flat = distance[:, np.newaxis] * direction[:, np.newaxis]
    centers = np.pad(flat, ((0, 0), (0, 0), (0, 1)), constant_values=scene.ball_radius)
    width = np.sqrt(scene.kT / _lean_stiffness(scene))
    leans = width * np.stack(np.meshgrid(LEANS, LEANS), axis=-1).reshape(-1, 2)
    weights = np.array([_log_weight(scene, centers, distance, lean) for lean in leans])
    weights = np.exp(weights - weights.max())  # shape (leans, azimuths, radii)
    total = weights.sum(axis=(0, 2))
    toward = leans @ direction.T
    lean = (weights.sum(axis=2) * toward).sum(axis=0) / total
    return Wells(azimuth, np.log(total.max() / total), lean)


def _sector(scene: Motor, count: int) -> Array:
    """Return evenly spaced azimuths from the first outer dipole to the next, in rad."""
    return np.linspace(0, 2 * np.pi / scene.outer_dipoles, count, endpoint=False)


def _leaning(scene: Motor, lean: ArrayLike) -> tuple[Array, Array]:
    """Return positions and moments of the inner ring, whose normal leans by (x, y) in rad."""
    x, y = np.asarray(lean)
    turn = Rotation.from_rotvec([-y, x, 0.0])
    frame, outward = (turn.apply(vectors) for vectors in scene.inner_dipole_frame())
    frame[:, 2] += scene.inner_height
    return frame, scene.moment * outward


def _outer_energy(scene: Motor, lean: ArrayLike) -> float:
    return float(dipoles.energy(*_leaning(scene, lean), *scene.outer_sources()).sum())


def _lean_stiffness(scene: Motor, step: float = 0.01) -> float:
    """Return the stiffness of the inner ring's lean in the field of the outer ring, in N m/rad."""
    level, leaning = (_outer_energy(scene, (lean, 0.0)) for lean in (0.0, step))
    return 2 * (leaning - level) / step**2


def _log_weight(scene: Motor, centers: Array, distance: Array, lean: Array) -> Array:
    """Return the logarithm of Gibbs' weight, integrated over the ball's axis."""
    places, moments = _leaning(scene, lean)
    fixed = scene.outer_sources()
    both = dipoles.pack_sources(
        np.vstack([places, fixed[0]]), np.vstack([scene.ball_ring_factor * moments, fixed[1]])
    )
    q = scene.moment * np.linalg.norm(total_field(scene, centers, both), axis=-1) / scene.kT
    over_axes = q - np.log(2 * q) + np.log1p(-np.exp(-2 * q))
    return np.log(distance) + over_axes - _outer_energy(scene, lean) / scene.kT


def ring_drag(scene: Motor, found: Wells) -> float:
    """Return the drag c_R lean^2 of the ring that leans toward the ball and follows it, in N m s.

    It is valid at rates far below that of the ring's own swing.
    """
    return scene.frictions[-1] * float(found.lean.mean()) ** 2


def equivalent_disk(scene: Motor, friction: float = 0.0) -> Disk:
    """Return the sliding disk that moves as the ball does around its valley.

    Its displacement is x = M phi for M wells, its unit of time the second.

    Parameters
    ----------
    scene : Motor
        At uniform temperature.
    friction : float
        Rate at which P is forgotten without wells and under a level ring, in 1/s.
    """
    ball, found = rolling(scene), wells(scene)
    mass = scene.ball_mass * (ball.radius / scene.outer_dipoles) ** 2
    kT = scene.kT / mass
    sigma = ball.inertia / (scene.ball_mass * ball.radius**2) - 1
    # At given d, the disk spreads by kT/c (sigma/(1 + sigma))^2.
    slip = kT * (sigma / (1 + sigma)) ** 2 / (ball.slip_diffusion * scene.outer_dipoles**2)
    waves = 2 * np.fft.rfft(found.free_energy)[1:3].real / SECTOR_POINTS * kT
    drag = (ring_drag(scene, found) + friction * ball.inertia) / (mass * scene.outer_dipoles**2)
    return Disk(
        sigma=sigma,
        friction=slip,
        noise=float(np.sqrt(2 * slip * kT)),
        potential=tuple((0.0, float(wave)) for wave in waves),
        drag=drag,
    )
