"""The paper's four simulations of the top: path over V_e, and J(t)."""

from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.ndimage import label

from magmotor import observables
from magmotor.common import style
from magmotor.common.style import save_small
from magmotor.devices.ball.landscape import valley
from magmotor.devices.top.plots import draw_momentum, draw_path
from magmotor.devices.top.scene import Top
from magmotor.run.simulate import simulate
from paper.figure import Claim, Figure, judged

TIMESTEP, DURATION = 0.025, 500.0
"""The paper's, in seconds."""

ROUNDING = 1e-17
"""In kg m^2/s: a J below this has come of rounding; a spin of 1 rad/s is 2.6e-5."""

FINER_RING = 40
"""Dipoles of a ring that is as good as continuous."""

SPINNING = 5.0
"""In rad/s, of a ball whose J is to be preserved, too."""

NEARBY = 1e-9
"""How far apart, in m, two starts are whose paths are to part."""

STARTS = ((0.01, 0.005), (0.02, 0.01), (0.01, -0.03), (-0.01, 0.02), (-0.03, 0.005))
"""Further starts of the fourth case, in m."""

NO_SPIN = 0.01
"""A spin so small beside that of a tilted ring, from the same start, counts as none."""

SETTLED = 10.0
"""From when, in s, the ball of the fourth case moves in the valley."""


@dataclass(frozen=True)
class Run:
    """A case by MuJoCo, and by the paper's integrator."""

    scene: Top
    mujoco: xr.Dataset
    variational: xr.Dataset

    @property
    def momentum(self) -> tuple[float, float]:
        """Largest |J| of both, in kg m^2/s."""
        return _largest(self.mujoco.momentum_map), _largest(self.variational.momentum_map)

    @property
    def place(self) -> np.ndarray:
        """Of the ball on the plane, shape (T, 2), in m."""
        return self.mujoco.position.values[:, :2]

    @property
    def radius(self) -> np.ndarray:
        """Distance of the ball from the center, in m."""
        return np.hypot(*self.place.T)


def _largest(values: xr.DataArray) -> float:
    return float(np.abs(values).max())


def run_case(case: int) -> Run:
    """One of the four at the paper's timestep and duration."""
    return _run(Top.paper(case))


@cache
def _run(scene: Top) -> Run:
    runs = [
        simulate(scene, method=method, timestep=TIMESTEP, duration=DURATION)
        for method in ("mujoco/rk4", "variational/cayley")
    ]
    return Run(scene, *runs)


def _spin(scene: Top) -> float:
    """Largest |J|/I_3, in rad/s."""
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
        f"from rest |J| ≤ {mujoco:.0e} kg m²/s by MuJoCo, {variational:.0e} by the variational"
        f" scheme; from a spin of {SPINNING:g} rad/s J changes by {changed:.0e} of it by MuJoCo,"
        f" the scheme's own J(1 + h²|ω|²/4) by {scheme:.0e}"
    )
    return judged(
        says, measured, max(mujoco, variational) < ROUNDING and max(changed, scheme) < 1e-9
    )


def _discrete_momentum(run: xr.Dataset) -> xr.DataArray:
    """What the paper's integrator preserves: by the Cayley map momenta differ from I omega."""
    return run.momentum_map * (1 + TIMESTEP**2 / 4 * (run.angular_velocity**2).sum("space"))


def _erratic(run: Run) -> tuple[bool, str]:
    """Whether starts close to each other end far apart, and how fast."""
    x, y = run.scene.position
    other = _run(run.scene.replace(position=(x + NEARBY, y))).mujoco
    apart = np.linalg.norm((other.position - run.mujoco.position).values, axis=1)
    thousandfold, parted = (
        float(run.mujoco.time[int(np.argmax(apart > far))]) for far in (1e3 * NEARBY, 0.01)
    )
    measured = (
        f"starts 1 nm apart are 1 µm apart at t = {thousandfold:.0f} s, 1 cm at {parted:.0f} s,"
        f" and up to {apart.max():.1f} m in the end"
    )
    return bool(apart.max() > 0.5 * run.scene.ring_radius), measured


def claims_of_case_1(run: Run) -> list[Claim]:
    """Of (fig:conaxi)."""
    circle = observables.valley_radius(run.scene, 0.0)
    reach = f"ρ from {run.radius.min():.3f} to {run.radius.max():.3f} m, valley at {circle:.3f} m"
    crossed = run.radius.max() > 1.1 * circle
    erratic, measured = _erratic(run)
    return [
        _preserved(run, "J(t) is preserved; no curious rotation"),
        judged(
            "The top bounces between the local maximum at the center and the circle of minima",
            f"{reach}: it crosses the circle and turns beyond it" if crossed else reach,
            not crossed,
            otherwise="in part",
        ),
        judged("The top undergoes what appears to be chaotic motion", measured, erratic),
    ]


def claims_of_case_2(run: Run) -> list[Claim]:
    """Of (fig:contilt)."""
    erratic, measured = _erratic(run)
    energy = float(run.mujoco.energy[0])
    (x, across), outer = forbidden_hole(run.scene, energy)
    later = run.radius[run.mujoco.time.values > 5]
    round_it = np.unwrap(np.arctan2(run.place[:, 1], run.place[:, 0] - x.mean()))
    sectors = np.unique(np.floor(18 * round_it / np.pi) % 36)
    return [
        _preserved(run, "J(t) is preserved; no curious rotation"),
        judged(
            "The top moves erratically within an annulus",
            f"its energy, {1e3 * energy:.3f} mJ, keeps it out of a hole about the maximum,"
            f" x from {x[0]:.3f} to {x[1]:.3f} m and |y| ≤ {across:.3f} m, and within ρ ="
            f" {outer:.3f} m; after 5 s its ρ is {later.min():.3f} to {later.max():.3f} m, in"
            f" {len(sectors)} of 36 directions; {measured}",
            erratic and x[0] < 0 < x[1] and later.max() <= outer and len(sectors) == 36,
        ),
    ]


def forbidden_hole(scene: Top, energy: float) -> tuple[tuple[np.ndarray, float], float]:
    """Where V_e exceeds an energy (J): the hole about its maximum, and the outside.

    Returns
    -------
    hole : tuple
        Its least and largest x, shape (2,), and its largest abs(y), all zero if there is none.
    outer : float
        The largest distance from the center, in m, that the energy allows.
    """
    highest = [p for p in observables.critical_points(scene) if p.kind == "maximum"]
    grid = np.linspace(-1.5 * scene.ring_radius, 1.5 * scene.ring_radius, 1021)  # every mm
    points = np.stack(np.meshgrid(grid, grid), axis=-1)
    allowed = observables.effective_potential(scene, points) <= energy
    outer = float(np.hypot(*points[allowed].T).max())
    if not highest or highest[-1].energy <= energy:
        return (np.zeros(2), 0.0), outer
    regions = np.empty(allowed.shape, dtype=np.intp)
    label(~allowed, output=regions)
    column, row = (int(np.abs(grid - value).argmin()) for value in highest[-1].position)
    x, y = points[regions == regions[row, column]].T
    return (np.array([x.min(), x.max()]), float(np.abs(y).max())), outer


def claims_of_case_3(run: Run) -> list[Claim]:
    """Of (fig:axi)."""
    scene, tilted = run.scene, Top.paper(4)
    lowest, ridge = observables.minimum(scene), observables.saddle(scene)
    radius, ripple = float(np.hypot(*lowest.position)), ridge.energy - lowest.energy
    above = (run.mujoco.energy.values - lowest.energy)[[0, -1]]
    late = run.place[run.mujoco.time.values > DURATION - 100]
    azimuth = np.degrees(np.unwrap(np.arctan2(*late.T[::-1])))
    on_ring = abs(run.radius[-1] - radius) < 1e-3
    spin = _spin(scene)
    fine = _spin(scene.replace(ring_dipoles=FINER_RING))
    most = _spin(tilted.replace(position=scene.position))
    elsewhere = _spin(scene.replace(position=tilted.position)), _spin(tilted)
    return [
        judged(
            "The top moves from the center to a point that minimizes the potential energy",
            f"it ends at ρ = {run.radius[-1]:.4f} m (the deepest points are at {radius:.4f} m),"
            f" {100 * (1 - above[1] / above[0]):.2f} % of the way down; but along the ring the"
            f" minima are {scene.ring_dipoles} points {1e6 * ripple:.2f} µJ deep, and in the last"
            f" 100 s it still swings between azimuths {azimuth.min():.0f}° and"
            f" {azimuth.max():.0f}° with {above[1] / ripple:.2f} of that energy left",
            bool(on_ring and above[1] < 0.1 * ripple),
            otherwise="in part" if on_ring and above[1] < ripple else "wrong",
        ),
        judged(
            "No spin develops",
            f"|spin| ≤ {spin:.2g} rad/s, {100 * spin / most:.0f} % of the {most:.2f} rad/s that"
            " the tilted ring gives from the same start (from case 4's start"
            f" {elsewhere[0]:.2g} of {elsewhere[1]:.2f} rad/s,"
            f" {100 * elsewhere[0] / elsewhere[1]:.1f} %); {100 * NO_SPIN:g} % would count as none."
            f" It comes of the ripple of {scene.ring_dipoles} dipoles: under {FINER_RING}"
            f" it is {fine:.0e} rad/s",
            spin < NO_SPIN * most,
            otherwise="in part" if fine < NO_SPIN * most else "wrong",
        ),
    ]


def claims_of_case_4(run: Run) -> list[Claim]:
    """Of (fig:tilt)."""
    (mujoco, variational), inertia = run.momentum, run.scene.inertia[2]
    when = float(run.mujoco.time[int(np.abs(run.mujoco.momentum_map.values).argmax())])
    late = _largest(run.mujoco.momentum_map.sel(time=slice(DURATION - 50, None))) / mujoco
    balance = observables.momentum_balance(run.mujoco, run.scene)
    residual = _largest(balance.residual) / mujoco
    spins = {start: _spin(run.scene.replace(position=start)) for start in STARTS}
    others = ", ".join(f"{spin:.2f} from {start}" for start, spin in spins.items())
    radius, part, turns = arcs(run)
    return [
        judged(
            "(a) shows that the top moves along arcs",
            f"after the first {SETTLED:.0f} s, {100 * part:.0f} % of its way have a radius of"
            f" curvature within a quarter of the valley's {radius:.3f} m; it turns back"
            f" {turns} times within {DURATION:.0f} s",
            part > 0.9 and turns > 0,
        ),
        judged(
            "The ball goes from a state of rest to a state of nonzero spin about its attitude",
            f"|J| = {mujoco:.4g} kg m²/s, {mujoco / inertia:.3g} rad/s, at t = {when:.1f} s"
            f" ({variational:.4g} by the variational scheme); it dies: {100 * late:.0f} % are"
            f" left in the last 50 s. How much it is depends on the start: {others} m",
            min(mujoco / inertia, *spins.values()) > 1,
        ),
        judged(
            "Ours: the spin is friction's, dJ/dt = c r ξ₃·(e_z × V_Q)",
            f"J and the integral differ by {residual:.0e} of the largest |J|",
            residual < 1e-3,
        ),
    ]


def arcs(run: Run) -> tuple[float, float, int]:
    """How the ball moves along the valley.

    Returns
    -------
    radius : float
        Mean distance of the valley from the center, in m.
    part : float
        Part of the length of the path with a radius of curvature within a quarter of that.
    turns : int
        How often the sense of rotation about the center changes.
    """
    radius = float(np.hypot(*valley(run.scene, np.linspace(0, 2 * np.pi, 181)).T).mean())
    late = run.mujoco.time.values > SETTLED
    velocity = run.mujoco.velocity.values[:, :2]
    acceleration = np.gradient(velocity, TIMESTEP, axis=0)
    speed = np.hypot(*velocity.T)[late]
    bend = np.abs(_cross(velocity, acceleration)[late]) / np.maximum(speed, 1e-12) ** 3
    on_arc = np.abs(1 / np.maximum(bend, 1e-12) / radius - 1) < 0.25
    sense = np.sign(_cross(run.place, velocity)[late])
    return radius, float(speed[on_arc].sum() / speed.sum()), int(np.sum(np.diff(sense) != 0))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def draw(run: Run, path: Path) -> None:
    """Path over V_e, and J(t) with the spin."""
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
        save_small(figure, path, dpi=90, shaded=True)


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
        f"The ring {tilt}, c = {scene.friction:g} kg/s, from rest at {scene.position} m with ξ₃ ="
        f" e_z; h = {TIMESTEP:g} s, T = {DURATION:g} s. Left the path over the levels of V_e, right"
        " J(t) by `mujoco/rk4`, by the paper's integrator (`variational/cayley`), and as the"
        " integral of friction's torque. Here ξ₃ is the ball's axis, J/I₃ its spin about it, ρ the"
        " distance from the center, V_e = -m|B| the magnetic energy of a ball whose axis is along"
        " the field; V_Q is the velocity of the contact point."
        + (" How large the spin is depends on the start." if case == 4 else "")
    )


FIGURES = [
    Figure(name, title, _caption(case), partial(_compute, case), claims, draw, (18 + case,))
    for case, (name, title, claims) in TITLES.items()
]
