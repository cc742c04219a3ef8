"""The effect of finite magnets on the ring, compared with dipoles of the same moment."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from magmotor import dipoles
from magmotor.common import style
from magmotor.devices.ball.landscape import aligned_force, on_plane
from magmotor.devices.top.scene import Top
from magmotor.mjcf.magnetism import magnetism
from magmotor.numerics.magnet_shapes import Cloud, ball, cuboid, cylinder
from magmotor.run.in_mujoco import build
from paper.bracket import bracket
from paper.figure import Claim, Figure, judged
from paper.top.finite_ring import build_finite_ring, finite_ring_sources

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

TIMESTEP, INTERVAL, DURATION = 0.025, 0.1, 60.0
"""Timestep, record interval and duration of runs, in s."""

NDFEB_MAGNETIZATION = 1.3 / (4e-7 * np.pi)
"""Magnetization of NdFeB with a remanence of 1.3 T, in A/m."""

ONE_PER_CENT = 0.01
RADIUS = 0.3
"""Radius, in m, of the part of the plane where the ball moves."""

EXAMPLE = 0.06
"""Size, in m, of the magnets for which J(t) is drawn."""


def cube(edge: float) -> Cloud:
    """A cube; its first correction to a dipole is of the fourth order in edge over distance."""
    return cuboid((edge, edge, edge))


def rod(edge: float) -> Cloud:
    """A cylinder as long, along x, as it is wide."""
    length = edge * (4 / np.pi) ** (1 / 3)
    return cylinder(length, length / 2)


def plate(edge: float) -> Cloud:
    """A cuboid four times as wide as it is thick, along x."""
    width = edge * 4 ** (1 / 3)
    return cuboid((width / 4, width, width))


def bar(edge: float) -> Cloud:
    """A cuboid four times as long, along x, as it is wide."""
    width = edge / 4 ** (1 / 3)
    return cuboid((4 * width, width, width))


SHAPES: dict[str, Callable[[float], Cloud]] = {"cube": cube, "rod": rod, "plate": plate, "bar": bar}
"""Shapes as functions of the edge, in m, of a cube of the same volume; the moment is along x."""


@dataclass(frozen=True)
class FiniteMagnets:
    """Differences from dipoles; a size is the edge, in m, of a cube of equal volume."""

    scene: Top
    edge: float
    """Edge of a cube of NdFeB with the moment of the scene's dipoles."""
    ball_force: float
    """Relative difference of the force on a magnetized ball from that on a dipole at its center."""
    edges: Array
    """Sizes, shape (E,)."""
    fields: dict[str, Array]
    """Largest relative difference of the field on the plane, by shape and size."""
    changes: dict[str, Array]
    """Largest difference of J over the largest |J|, by shape and size."""
    at_edge: dict[str, float]
    """The same for the volume of the cube of NdFeB."""
    thresholds: dict[str, tuple[float, float]]
    """Sizes at which J changes by less than 1 %, and by more than 1 %."""
    valleys: dict[str, float]
    """Distance, in m, of the valley's lowest point from the center, for the size `EXAMPLE`."""
    examples: dict[str, Array]
    """Spin J/I_3 in rad/s with dipoles, and with magnets of the size `EXAMPLE`."""


@cache
def compute(quick: bool) -> FiniteMagnets:
    """Compute fields on the plane, and simulate the fourth case."""
    scene = Top()
    edges = np.geomspace(0.008, 0.085, 5 if quick else 9)
    edge = (scene.moment / NDFEB_MAGNETIZATION) ** (1 / 3)

    def change(shape: str, size: float) -> float:
        reference = _momentum(scene, "dipole", 0.0)
        momentum = _momentum(scene, shape, size)
        return float(np.abs(momentum - reference).max() / np.abs(reference).max())

    changes = {s: np.array([change(s, float(a)) for a in edges]) for s in SHAPES}
    thresholds = {}
    for shape in SHAPES:
        over = int(np.argmax(changes[shape] > ONE_PER_CENT))
        ends = float(edges[over - 1]), float(edges[over])
        below = partial(lambda shape, a: change(shape, a) < ONE_PER_CENT, shape)
        thresholds[shape] = bracket(below, *ends, 1.4 if quick else 1.03)
    kinds = ("dipole", *SHAPES)
    return FiniteMagnets(
        scene,
        edge,
        _ball_force(scene),
        edges,
        {shape: np.array([_field(scene, shape, float(a)) for a in edges]) for shape in SHAPES},
        changes,
        {shape: change(shape, edge) for shape in SHAPES},
        thresholds,
        {kind: _valley(scene, kind) for kind in kinds},
        {k: _momentum(scene, k, EXAMPLE) / scene.inertia[2] for k in kinds},
    )


@cache
def _momentum(scene: Top, kind: str, edge: float) -> Array:
    """Return J of a run with a ring of dipoles, or of magnets of a shape."""
    if kind == "dipole":
        return momentum(scene, build(scene))
    return momentum(scene, build_finite_ring(scene, SHAPES[kind](edge)))


def momentum(scene: Top, model: mujoco.MjModel, duration: float = DURATION) -> Array:
    """Return J, in kg m^2/s, at each record of a run by RK4, shape (T,)."""
    model.opt.timestep, model.opt.integrator = TIMESTEP, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    spin = np.zeros(round(duration / INTERVAL) + 1)
    with magnetism():
        for n in range(1, len(spin)):
            mujoco.mj_step(model, data, nstep=round(INTERVAL / TIMESTEP))
            spin[n] = data.qvel[-1]
    return scene.inertia[2] * spin


def _ball_force(scene: Top) -> float:
    """Return `ball_force` at the valley's lowest point, for a ball magnetized along the field."""
    lowest = [_valley(scene, "dipole"), 0.0]
    force, axis = aligned_force(scene, lowest)
    points, weights = ball(scene.ball_radius)
    positions = points + on_plane(scene, lowest)
    moments = scene.moment * np.outer(weights, axis)
    whole = dipoles.wrench(positions, moments, *scene.ring_sources())[0].sum(axis=0)
    return float(np.linalg.norm(whole - force) / np.linalg.norm(force))


def _field(scene: Top, shape: str, edge: float) -> float:
    """Return the largest relative difference of the field on a disk at the ball's height."""
    side = RADIUS * np.linspace(-1, 1, 41)
    points = np.stack([*np.meshgrid(side, side), np.full((41, 41), scene.ball_radius)], axis=-1)
    points = points[np.hypot(points[..., 0], points[..., 1]) <= RADIUS]
    field = dipoles.field(points, *scene.ring_sources())
    finite = dipoles.field(points, *finite_ring_sources(scene, SHAPES[shape](edge)))
    relative = np.linalg.norm(finite - field, axis=1) / np.linalg.norm(field, axis=1)
    return float(relative.max())


def _valley(scene: Top, kind: str) -> float:
    """Return x of the strongest field on the low side, y = 0, at the ball's height."""
    sources = scene.ring_sources()
    if kind != "dipole":
        sources = finite_ring_sources(scene, SHAPES[kind](EXAMPLE))

    def weakness(x: float) -> float:
        return -float(np.linalg.norm(dipoles.field([x, 0.0, scene.ball_radius], *sources)))

    found = minimize_scalar(weakness, bounds=(0.1, 0.4), method="bounded", options={"xatol": 1e-8})
    return float(found.x)


def order(edges: Array, differences: Array) -> float:
    """Return the slope of log(difference) against log(size) at the smallest sizes."""
    return float(np.polyfit(np.log(edges[:3]), np.log(differences[:3]), 1)[0])


def claims(data: FiniteMagnets) -> list[Claim]:
    """Return the claims that the fields and runs decide."""
    moment, volume = data.scene.moment, 4 / 3 * np.pi * data.scene.ball_radius**3
    needed, needed_si = moment / volume, Top.si().moment / volume
    orders = {shape: order(data.edges, field) for shape, field in data.fields.items()}
    others = [shape for shape in SHAPES if shape != "cube"]
    return [
        judged(
            "Ours: a ball magnetized throughout acts as a dipole fixed at its centroid",
            "the force on a ball magnetized throughout differs from that on a dipole by"
            f" {data.ball_force:.0e} of it (mean values of harmonic functions); it requires"
            f" {needed / 1e6:.2f} MA/m, and NdFeB has {NDFEB_MAGNETIZATION / 1e6:.2f}",
            data.ball_force < 1e-9 and needed < NDFEB_MAGNETIZATION,
        ),
        judged(
            "Ours: a permanent magnet has the ball's moment, in the SI reading",
            f"100 A m² in a ball of 1.8 cm requires {needed_si / 1e6:.1f} MA/m, and NdFeB has"
            f" {NDFEB_MAGNETIZATION / 1e6:.2f}",
            needed_si < NDFEB_MAGNETIZATION,
        ),
        judged(
            "Ours: a ring of cubes acts as a ring of dipoles",
            f"cubes of NdFeB have edges of {100 * data.edge:.2f} cm and change J by"
            f" {data.at_edge['cube']:.0e} of its largest value; the change of the field is of"
            f" order {orders['cube']:.2f} in the edge; 1 % of J at"
            f" {_centimeters(data.thresholds['cube'])}",
            data.at_edge["cube"] < ONE_PER_CENT,
        ),
        judged(
            "Ours: a ring of magnets of other shapes does, too",
            "; ".join(
                f"{shape}: {100 * data.at_edge[shape]:.2g} % at the volume of that cube, order"
                f" {orders[shape]:.2f}, 1 % at {_centimeters(data.thresholds[shape])}"
                for shape in others
            ),
            max(data.at_edge[shape] for shape in others) < ONE_PER_CENT,
            otherwise="in part",
        ),
        judged(
            "Ours: magnets of another shape do not change the ball's position and the size of its"
            " spin",
            f"bodies with the volume of a {100 * EXAMPLE:.0f} cm cube, instead of dipoles: largest"
            f" spin {_listed({k: float(np.abs(s).max()) for k, s in data.examples.items()})} rad/s;"
            f" the valley's lowest point {_listed(data.valleys)} m from the center",
            _spread(np.abs(spin).max() for spin in data.examples.values()) < 0.01,
            otherwise="in part",
        ),
    ]


def _centimeters(limits: tuple[float, float]) -> str:
    return f"{100 * limits[0]:.2f} to {100 * limits[1]:.2f} cm"


def _listed(values: dict[str, float]) -> str:
    return ", ".join(f"{value:.4g} ({kind}s)" for kind, value in values.items())


def _spread(values: Iterable[float]) -> float:
    first, *others = values
    return max(abs(value / first - 1) for value in others)


STYLES = {
    "dipole": (style.INK, ""),
    "cube": (style.BLUE, "s"),
    "rod": (style.GREEN, "o"),
    "plate": (style.ORANGE, "D"),
    "bar": (style.PURPLE, "^"),
}
"""Color and marker."""


def draw(data: FiniteMagnets, path: Path) -> None:
    """Draw the change of J against the size, and J(t)."""
    with style.figure(9.0, 4.4) as figure:
        left, right = figure.subplots(1, 2)
        _draw_changes(left, data)
        _draw_spin(right, data)
        style.save(figure, path, dpi=110)


def _draw_changes(axes: "Axes", data: FiniteMagnets) -> None:
    sizes = 100 * data.edges
    for shape, changes in data.changes.items():
        color, marker = STYLES[shape]
        axes.plot(sizes, changes, marker=marker, ms=5, color=color, label=f"{shape}s")
    axes.axhline(ONE_PER_CENT, color=style.GRAY, lw=1)
    axes.axvline(100 * data.edge, color=style.GRAY, ls=":", label="cube of NdFeB")
    axes.set(xscale="log", yscale="log", title="Largest change of J over largest |J|")
    axes.set(xlabel="edge of a cube of the same volume (cm)", ylabel="relative change")
    axes.set_xticks([1, 2, 3, 5, 9], labels=["1", "2", "3", "5", "9"])
    axes.set_xticks([], minor=True)
    axes.legend(loc="lower right")


def _draw_spin(axes: "Axes", data: FiniteMagnets) -> None:
    for kind, spin in data.examples.items():
        time = INTERVAL * np.arange(len(spin))
        width, dashes = {"dipole": (4, "-"), "rod": (1.6, "--")}.get(kind, (1.6, "-"))
        axes.plot(time, spin, dashes, color=STYLES[kind][0], lw=width, label=f"{kind}s")
    axes.set(xlabel="t (s)", ylabel="spin J/I₃ (rad/s)")
    axes.set(title=f"Bodies of the volume of a {100 * EXAMPLE:.0f} cm cube")
    axes.legend(ncols=2, loc="lower right")


FIGURE = Figure(
    name="finite_magnets",
    title="Finite magnets instead of dipoles",
    caption=(
        "The paper's fourth case (N = 20, H = 20 cm, r_ring = 34 cm, θ_R = π/64, c = 0.3 kg/s)"
        " with uniformly magnetized bodies of the same moment, 10 A m², on the ring, each"
        " represented by a few dozen dipoles at quadrature points. Rods are cylinders as long as"
        " they are wide, plates are four times as wide as thick, and bars are four times as long"
        " as wide; all are magnetized along the radius. The first correction to the dipole is of"
        " the fourth order in size over distance for a cube, and for a cylinder whose length is"
        " √3 radii; for the other shapes here, it is of the second order. The moments are those"
        " of the unit reading of the paper's parameters; in the SI reading, every dipole has 100"
        " A m². Plates larger than 6.5 cm would touch their neighbors."
    ),
    compute=compute,
    claims=claims,
    draw=draw,
    methods=("mujoco/rk4",),
)
