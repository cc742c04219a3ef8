"""The paper's four simulations of the top: path on V_e, and J(t)."""

from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.ndimage import label

from magmotor import observables
from magmotor.common import style
from magmotor.devices.ball.landscape import valley
from magmotor.devices.top.plots import draw_momentum, draw_path
from magmotor.devices.top.scene import Top
from magmotor.run.simulate import simulate
from paper.figure import Claim, Figure, judged

TIMESTEP, DURATION = 0.025, 500.0
"""The paper's, in seconds."""

ROUNDING = 1e-17
"""In kg m^2/s: J below this is due to rounding; a spin of 1 rad/s is 2.6e-5."""

FINER_RING = 40
"""Number of dipoles of a practically continuous ring."""

SPINNING = 5.0
"""Initial spin, in rad/s, of a second test of the conservation of J."""

METHODS = ("mujoco/rk4", "variational/cayley")
"""MuJoCo's method and the paper's."""

NEARBY = 1e-9
"""Initial distance, in m, of two runs whose paths diverge."""

HOLE = 0.05
"""Share of the area from which on a hole makes a disk an annulus."""

STARTS = ((0.01, 0.005), (0.02, 0.01), (0.01, -0.03), (-0.01, 0.02), (-0.03, 0.005))
"""Further initial positions of the fourth case, in m."""

NO_SPIN = 0.01
"""Ratio to the spin under a tilted ring, from the same start, below which spin counts as none."""

SETTLED = 10.0
"""Time, in s, after which the ball of the fourth case moves in the valley."""


@dataclass(frozen=True)
class Run:
    """A case, simulated by MuJoCo and by the paper's integrator."""

    scene: Top
    mujoco: xr.Dataset
    variational: xr.Dataset

    @property
    def momentum(self) -> tuple[float, float]:
        """Largest |J| of both runs, in kg m^2/s."""
        return _largest(self.mujoco.momentum_map), _largest(self.variational.momentum_map)

    @property
    def plane_position(self) -> np.ndarray:
        """Position of the ball on the plane, shape (T, 2), in m."""
        return self.mujoco.position.values[:, :2]

    @property
    def radius(self) -> np.ndarray:
        """Distance of the ball from the center, in m."""
        return np.hypot(*self.plane_position.T)


def _largest(values: xr.DataArray) -> float:
    return float(np.abs(values).max())


def run_case(case: int) -> Run:
    """Simulate one of the four cases at the paper's timestep and duration."""
    return _run(Top.paper(case))


@cache
def _run(scene: Top) -> Run:
    runs = [
        simulate(scene, method=method, timestep=TIMESTEP, duration=DURATION) for method in METHODS
    ]
    return Run(scene, *runs)


def _spin(scene: Top) -> float:
    """Return the largest |J|/I_3, in rad/s."""
    return _run(scene).momentum[0] / scene.inertia[2]


def _compute(case: int, _quick: bool) -> Run:
    return run_case(case)


def _preserved(run: Run, says: str) -> Claim:
    mujoco, variational = run.momentum
    spinning = _run(run.scene.replace(spin=SPINNING))
    changed, scheme = (
        _largest(preserved / preserved[0] - 1)
        for preserved in (spinning.mujoco.momentum_map, _discrete_momentum(spinning.variational))
    )
    measured = (
        f"from rest |J| ≤ {mujoco:.0e} kg m²/s with MuJoCo, {variational:.0e} with the variational"
        f" scheme; with an initial spin of {SPINNING:g} rad/s the relative change of J is"
        f" {changed:.0e} with MuJoCo, and that of the scheme's own J(1 + h²|ω|²/4) is {scheme:.0e}"
    )
    return judged(
        says, measured, max(mujoco, variational) < ROUNDING and max(changed, scheme) < 1e-9
    )


def _discrete_momentum(run: xr.Dataset) -> xr.DataArray:
    """Return the momentum that the paper's integrator conserves, which differs from J."""
    return run.momentum_map * (1 + TIMESTEP**2 / 4 * (run.angular_velocity**2).sum("space"))


def _separation(scene: Top) -> np.ndarray:
    """Return the distance of two balls that start `NEARBY`, at each time, in m."""
    x, y = scene.position
    runs = (_run(scene.replace(position=(start, y))).mujoco for start in (x, x + NEARBY))
    first, second = (run.position.values for run in runs)
    return np.linalg.norm(second - first, axis=1)


def _erratic(run: Run) -> tuple[bool, str]:
    """Whether nearby starts end far apart, and a text that describes how fast."""
    separation = _separation(run.scene)
    thousandfold, separated = (
        float(run.mujoco.time[int(np.argmax(separation > distance))])
        for distance in (1e3 * NEARBY, 0.01)
    )
    measured = (
        f"starts 1 nm apart are 1 µm apart at t = {thousandfold:.0f} s, 1 cm at {separated:.0f} s,"
        f" and finally up to {separation.max():.1f} m"
    )
    return bool(separation.max() > 0.5 * run.scene.ring_radius), measured


def claims_of_case_1(run: Run) -> list[Claim]:
    """Return the claims of (fig:conaxi)."""
    circle = observables.valley_radius(run.scene, 0.0)
    reach = f"ρ from {run.radius.min():.3f} to {run.radius.max():.3f} m, valley at {circle:.3f} m"
    crossed = run.radius.max() > 1.1 * circle
    erratic, measured = _erratic(run)
    smooth = _separation(run.scene.replace(ring_dipoles=FINER_RING)).max()
    return [
        _preserved(run, "(b) shows that J(t) is preserved as predicted by the theory"),
        judged(
            "(a) shows that the top bounces between the local maximum at the center and the circle"
            " of minima",
            f"{reach}: it crosses the circle and turns back beyond it" if crossed else reach,
            not crossed,
            otherwise="in part",
        ),
        judged(
            "The magnetostatic field is axisymmetric ... In this case the top undergoes what"
            " appears to be chaotic motion",
            f"{measured}. But {run.scene.ring_dipoles} dipoles are not quite axisymmetric: under a"
            f" ring of {FINER_RING} the starts are at most {1e6 * smooth:.0f} µm apart in"
            f" {DURATION:.0f} s, and the motion is regular",
            erratic and smooth > 0.01,
            otherwise="in part" if erratic else "wrong",
        ),
    ]


def claims_of_case_2(run: Run) -> list[Claim]:
    """Return the claims of (fig:contilt)."""
    erratic, measured = _erratic(run)
    energy = float(run.mujoco.energy[0])
    (x, across), outer, share = forbidden_hole(run.scene, energy)
    later = run.radius[run.mujoco.time.values > 5]
    angle = np.unwrap(np.arctan2(run.plane_position[:, 1], run.plane_position[:, 0] - x.mean()))
    sectors = np.unique(np.floor(18 * angle / np.pi) % 36)
    annular = erratic and x[0] < 0 < x[1] and later.max() <= outer and len(sectors) == 36
    return [
        _preserved(run, "(b) confirms that J(t) is preserved; no curious rotation in this case"),
        judged(
            "(a) shows that the top moves erratically within an annulus",
            f"its energy, {1e3 * energy:.3f} mJ, excludes a hole around the maximum,"
            f" x from {x[0]:.3f} to {x[1]:.3f} m and |y| ≤ {across:.3f} m, and everything beyond ρ"
            f" = {outer:.3f} m; after 5 s it is at ρ from {later.min():.3f} to {later.max():.3f}"
            f" m, in {len(sectors)} of 36 directions; {measured}. But the hole has only"
            f" {100 * share:.2f} % of the area: the annulus is nearly a disk",
            annular and share > HOLE,
            otherwise="in part" if annular else "wrong",
        ),
    ]


def forbidden_hole(scene: Top, energy: float) -> tuple[tuple[np.ndarray, float], float, float]:
    """Find where V_e exceeds an energy (J): the hole around its maximum, and the outside.

    Returns
    -------
    hole : tuple
        Smallest and largest x, shape (2,), and largest abs(y); all zero if there is no hole.
    outer : float
        Largest distance from the center, in m, that the energy allows.
    share : float
        Area of the hole over that of the hole and what the energy allows around it.
    """
    highest = [p for p in observables.critical_points(scene) if p.kind == "maximum"]
    grid = np.linspace(-1.5 * scene.ring_radius, 1.5 * scene.ring_radius, 1021)  # every mm
    points = np.stack(np.meshgrid(grid, grid), axis=-1)
    allowed = observables.effective_potential(scene, points) <= energy
    outer = float(np.hypot(*points[allowed].T).max())
    if not highest or highest[-1].energy <= energy:
        return (np.zeros(2), 0.0), outer, 0.0
    regions = np.empty(allowed.shape, dtype=np.intp)
    label(~allowed, output=regions)
    column, row = (int(np.abs(grid - value).argmin()) for value in highest[-1].position)
    hole = regions == regions[row, column]
    share = float(hole.sum() / (hole.sum() + allowed.sum()))
    x, y = points[hole].T
    return (np.array([x.min(), x.max()]), float(np.abs(y).max())), outer, share


def claims_of_case_3(run: Run) -> list[Claim]:
    """Return the claims of (fig:axi)."""
    scene, tilted = run.scene, Top.paper(4)
    lowest, ridge = observables.minimum(scene), observables.saddle(scene)
    radius, ripple = float(np.hypot(*lowest.position)), ridge.energy - lowest.energy
    above = (run.mujoco.energy.values - lowest.energy)[[0, -1]]
    late = run.plane_position[run.mujoco.time.values > DURATION - 100]
    azimuth = np.degrees(np.unwrap(np.arctan2(*late.T[::-1])))
    on_ring = abs(run.radius[-1] - radius) < 1e-3
    spin = _spin(scene)
    fine = _spin(scene.replace(ring_dipoles=FINER_RING))
    most = _spin(tilted.replace(position=scene.position))
    from_case_4 = _spin(scene.replace(position=tilted.position)), _spin(tilted)
    return [
        judged(
            "(a) shows that the top moves from the local maximum at the center to a point that"
            " minimizes the potential energy",
            f"it ends at ρ = {run.radius[-1]:.4f} m (the deepest points are at {radius:.4f} m),"
            f" {100 * (1 - above[1] / above[0]):.2f} % of the way down; but along the ring there"
            f" are {scene.ring_dipoles} minima, {1e6 * ripple:.2f} µJ deep, and in the last 100 s"
            f" it still oscillates between azimuths {azimuth.min():.0f}° and {azimuth.max():.0f}°"
            f" with {above[1] / ripple:.2f} of that energy",
            bool(on_ring and above[1] < 0.1 * ripple),
            otherwise="in part" if on_ring and above[1] < ripple else "wrong",
        ),
        judged(
            "However, (b) shows that no spin develops",
            f"|spin| ≤ {spin:.2g} rad/s, {100 * spin / most:.0f} % of the {most:.2f} rad/s under"
            " the tilted ring from the same start (from case 4's start"
            f" {from_case_4[0]:.2g} of {from_case_4[1]:.2f} rad/s,"
            f" {100 * from_case_4[0] / from_case_4[1]:.1f} %); {100 * NO_SPIN:g} % would count as"
            f" none. The ripple of {scene.ring_dipoles} dipoles causes it: with {FINER_RING}"
            f" dipoles it is {fine:.0e} rad/s",
            spin < NO_SPIN * most,
            otherwise="in part" if fine < NO_SPIN * most else "wrong",
        ),
    ]


def claims_of_case_4(run: Run) -> list[Claim]:
    """Return the claims of (fig:tilt)."""
    (mujoco, variational), inertia = run.momentum, run.scene.inertia[2]
    when = float(run.mujoco.time[int(np.abs(run.mujoco.momentum_map.values).argmax())])
    late = _largest(run.mujoco.momentum_map.sel(time=slice(DURATION - 50, None))) / mujoco
    balance = observables.momentum_balance(run.mujoco, run.scene)
    residual = _largest(balance.residual) / mujoco
    frictionless = _run(run.scene.replace(friction=0.0)).momentum[0]
    spins = {start: _spin(run.scene.replace(position=start)) for start in STARTS}
    others = ", ".join(f"{spin:.2f} from {start}" for start, spin in spins.items())
    radius, fraction, reversals = arcs(run)
    return [
        judged(
            "(a) shows that the top moves along arcs",
            f"after the first {SETTLED:.0f} s, {100 * fraction:.0f} % of its path has a radius of"
            f" curvature within 25 % of the valley's {radius:.3f} m; it turns back"
            f" {reversals} times within {DURATION:.0f} s",
            fraction > 0.9 and reversals > 0,
        ),
        judged(
            "The ball goes from a state of rest to a state of nonzero spin about its attitude",
            f"|J| = {mujoco:.4g} kg m²/s, {mujoco / inertia:.3g} rad/s, at t = {when:.1f} s"
            f" ({variational:.4g} with the variational scheme); it decays: {100 * late:.0f} %"
            f" remain in the last 50 s. Its size depends on the start: {others} m",
            min(mujoco / inertia, *spins.values()) > 1,
        ),
        judged(
            "The spinning of the top in Hamel's device is due to surface friction",
            f"J differs by {residual:.0e} of its largest value from the integral of friction's"
            f" dJ/dt = c r ξ₃·(e_z × V_Q); without friction |J| ≤ {frictionless:.0e} kg m²/s",
            residual < 1e-3 and frictionless < ROUNDING,
        ),
    ]


def arcs(run: Run) -> tuple[float, float, int]:
    """Characterize the ball's motion along the valley.

    Returns
    -------
    radius : float
        Mean distance of the valley from the center, in m.
    fraction : float
        Fraction of the path's length with a radius of curvature within a quarter of `radius`.
    reversals : int
        Number of reversals of the motion around the center.
    """
    radius = float(np.hypot(*valley(run.scene, np.linspace(0, 2 * np.pi, 181)).T).mean())
    late = run.mujoco.time.values > SETTLED
    velocity = run.mujoco.velocity.values[:, :2]
    acceleration = np.gradient(velocity, TIMESTEP, axis=0)
    speed = np.hypot(*velocity.T)[late]
    bend = np.abs(_cross(velocity, acceleration)[late]) / np.maximum(speed, 1e-12) ** 3
    on_arc = np.abs(1 / np.maximum(bend, 1e-12) / radius - 1) < 0.25
    sense = np.sign(_cross(run.plane_position, velocity)[late])
    return radius, float(speed[on_arc].sum() / speed.sum()), int(np.sum(np.diff(sense) != 0))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def draw(run: Run, path: Path) -> None:
    """Draw the path on V_e, and J(t) with the spin."""
    with style.figure(12.0, 5.4) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.15))
        draw_path(left, run.mujoco, run.scene)
        _, residual = draw_momentum(right, run.mujoco, run.scene)
        right.plot(
            run.variational.time, run.variational.momentum_map, ":", color=style.INK, lw=1.0,
            label="variational/cayley",
        )  # fmt: skip
        right.set(title=f"J: simulated and theory differ by {residual:.1e} kg m²/s at most")
        right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3)
        style.save(figure, path, dpi=90, shaded=True)


TITLES = {
    1: ("conservative_axisymmetric", "Conservative, axisymmetric", claims_of_case_1),
    2: ("conservative_tilted", "Conservative, tilted", claims_of_case_2),
    3: ("nonconservative_axisymmetric", "Nonconservative, axisymmetric", claims_of_case_3),
    4: ("nonconservative_tilted", "Nonconservative, tilted", claims_of_case_4),
}


def _caption(case: int) -> str:
    scene = Top.paper(case)
    tilt = "tilted by π/64" if scene.tilt else "level"
    return (
        f"The ring is {tilt}, c = {scene.friction:g} kg/s; the ball starts from rest at"
        f" {scene.position} m with ξ₃ = e_z; h = {TIMESTEP:g} s, T = {DURATION:g} s. Left: the"
        " path over the level lines of V_e. Right: J(t) from `mujoco/rk4`, from the paper's"
        " integrator (`variational/cayley`), and from the integral of the friction torque. Here"
        " ξ₃ is the ball's axis, J/I₃ its spin about this axis, ρ the distance from the center,"
        " V_e = -m|B| the magnetic energy of a ball whose axis is along the field, and V_Q the"
        " velocity of the contact point."
        + (" The size of the spin depends on the start." if case == 4 else "")
    )


FIGURES = [
    Figure(
        name, title, _caption(case), partial(_compute, case), claims, draw, (18 + case,), METHODS
    )
    for case, (name, title, claims) in TITLES.items()
]
