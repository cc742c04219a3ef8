"""The coupling at which the magnets lift the ball off its plane."""

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.device.stops import SimulationStopped
from magmotor.devices.top.scene import Top
from magmotor.run.simulate import simulate
from paper.bracket import bracket
from paper.figure import Claim, Figure, judged
from paper.top.lift import Lift, critical_height, largest_lift, lift_map

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Bracket = tuple[float, float]

METHOD, TIMESTEP, DURATION = "mujoco/euler", 0.002, 60.0
OFF = 1e-4
"""Height above the plane, in m, that only a lifted ball has: a resting one rises by 2e-6 m."""


CLOSE = 1.15
"""Largest ratio of a measured to a static coupling that confirms statics."""


@dataclass(frozen=True)
class LiftOff:
    """Lifts relative to the ball's weight, couplings in J m^3."""

    scene: Top
    lift: Lift
    """Largest lift on the plane of the scene, for a ball aligned with the field."""
    bracket: Bracket
    """Couplings at which runs of the scene stay on the plane, and leave it."""
    first: "Departure"
    """Departure at the second of these couplings."""
    heights: Array
    """Heights of the ring, in m, shape (H,)."""
    aligned: Array
    """Smallest coupling that lifts an aligned ball somewhere on the plane, for each height."""
    ran: Array
    """Heights at which the coupling was bracketed by runs, in m, shape (R,)."""
    brackets: Array
    """Couplings at which these runs stay, and leave, shape (R, 2)."""
    height_at_unit: tuple[float, Bracket]
    """Critical height for the scene's coupling: of an aligned ball, and by runs (leaves, stays)."""
    caught: Bracket
    """Heights at which the ball ends in a well on the higher side, and on the lower side."""
    si: "Departure"


@dataclass(frozen=True)
class Departure:
    """A ball that leaves the plane."""

    time: float
    """In s."""
    place: Array
    """In m, shape (2,)."""
    lift: float
    """Lift of an aligned ball there, over the weight."""
    misalignment: float
    """Angle between its axis and the field, in rad."""


@cache
def compute(quick: bool) -> LiftOff:
    """Scan height and coupling by statics and by runs on the plane."""
    scene = Top(surface="plane")
    ratio = 1.05 if quick else 1.01
    heights = np.linspace(0.05, 0.35, 7 if quick else 31)
    lifts = [largest_lift(scene.replace(ring_height=float(height))) for height in heights]
    ran = np.array([0.1, 0.2] if quick else [0.06, 0.08, 0.1, 0.13, 0.16, 0.2, 0.25, 0.3, 0.35])
    brackets = np.array([_critical_coupling(float(height), ratio) for height in ran])
    stays, leaves = (float(k) for k in brackets[ran == scene.ring_height][0])
    first = departure(scene.replace(coupling=leaves))
    si = departure(Top.si(surface="plane"))
    assert first is not None
    assert si is not None
    height = critical_height(scene)
    around = bracket(
        lambda h: departure(scene.replace(ring_height=h)) is not None, 0.5 * height, 0.12, ratio
    )
    return LiftOff(
        scene,
        largest_lift(scene),
        (stays, leaves),
        first,
        heights,
        scene.coupling / np.array([lift.aligned for lift in lifts]),
        ran,
        brackets,
        (height, around),
        bracket(lambda h: _is_caught(scene.replace(ring_height=h)), 0.1, 0.13, ratio),
        si,
    )


def _critical_coupling(height: float, ratio: float) -> Bracket:
    """Return couplings at which the ball stays on the plane, and leaves it."""
    scene = Top(surface="plane", ring_height=height)
    expected = scene.coupling / largest_lift(scene).any_axis

    def stays(coupling: float) -> bool:
        return departure(scene.replace(coupling=coupling)) is None

    largest = 2 * expected
    while stays(largest):
        largest *= 2
    return bracket(stays, 0.9 * expected, largest, ratio)


def _is_caught(scene: Top) -> bool:
    """Whether the ball stays on the side of the center where it starts, for a minute."""
    run = simulate(scene, method=METHOD, timestep=TIMESTEP, duration=DURATION)
    return bool((run.position.values[:, 0] < 0).all())


@cache
def departure(scene: Top) -> Departure | None:
    """Return where and when the ball leaves the plane; None if it stays for a minute."""
    try:
        run = simulate(scene, method=METHOD, timestep=TIMESTEP, duration=DURATION)
    except SimulationStopped as fell_into_a_dipole:
        run = fell_into_a_dipole.dataset
    off = np.flatnonzero(run.position.values[:, 2] > scene.ball_radius + OFF)
    if not off.size:
        return None
    row = run.isel(time=off[0])
    place = row.position.values[:2]
    lift, axis = lift_map(scene, place)
    angle = math.acos(min(1.0, float(row.axis.values @ axis)))
    return Departure(float(row.time), place, float(lift), angle)


def claims(data: LiftOff) -> list[Claim]:
    """Return the claims that statics and the runs decide."""
    scene, (stays, leaves), first, si = data.scene, data.bracket, data.first, data.si
    static = scene.coupling / data.lift.aligned
    bound = scene.coupling / data.lift.any_axis
    height, (leaves_at, stays_at) = data.height_at_unit
    excess = data.brackets[:, 1] / np.interp(data.ran, data.heights, data.aligned)
    low = data.ran < data.caught[0]
    return [
        judged(
            "“This holonomic constraint restricts the translational motion of the ball to a plane”"
            " (moments in the unit reading)",
            f"the lift of an aligned ball is at most {100 * data.lift.aligned:.2f} % of the weight,"
            f" at ({data.lift.place[0]:.3f}, {abs(data.lift.place[1]):.3f}) m, and"
            f" {100 * data.lift.any_axis:.2f} % for any direction of its axis",
            data.lift.any_axis < 1,
        ),
        judged(
            "Ours: the ball stays on the plane with moments in the SI reading, too",
            f"it leaves at t = {si.time:.2f} s and ({si.place[0]:.3f}, {si.place[1]:.3f}) m, where"
            f" the lift of an aligned ball is {si.lift:.2f} of its weight and its axis is"
            f" {math.degrees(si.misalignment):.1f}° off the field",
            data.lift.any_axis * Top.si().coupling < scene.coupling,
        ),
        judged(
            "Ours: the ball leaves when the largest lift of an aligned ball exceeds its weight",
            f"runs stay at a coupling of {stays:.3g} J m³ and leave at {leaves:.3g} (statics:"
            f" {static:.3g}; no motion can leave below {bound:.3g}), at ({first.place[0]:.3f},"
            f" {first.place[1]:.3f}) m with a lift of {first.lift:.3f} of the weight; under rings"
            " at"
            f" H ≥ {data.ran[~low][0]:g} m they leave at {excess[~low].min():.2f} to"
            f" {excess[~low].max():.2f} times the coupling of statics, since they pass beside the"
            " position of the largest lift; under lower rings, at H ="
            f" {_listed(data.ran[low], '.2f')} m, at"
            f" {_listed(excess[low], '.0f')} times: a dipole of the higher side catches the ball"
            " far from that position",
            bool(np.all(excess < CLOSE)),
            otherwise="in part" if np.all(excess[~low] < CLOSE) else "wrong",
        ),
        judged(
            "Ours: lift-off bounds from below the range of heights in which the top spins",
            f"with moments in the unit reading it leaves the plane under a ring at {leaves_at:.4f}"
            f" m or lower, and stays at {stays_at:.4f} m (statics, at the lowest dipole:"
            f" {height:.4f} m); but up to {data.caught[0]:.3f} m, though not at"
            f" {data.caught[1]:.3f} m, a single dipole of the higher side catches it",
            leaves_at > data.caught[0],
        ),
    ]


def _listed(values: Array, form: str) -> str:
    return ", ".join(format(value, form) for value in values)


def draw(data: LiftOff, path: Path) -> None:
    """Draw the lift on the plane, and the critical coupling against the ring's height."""
    with style.figure(9.0, 4.4) as figure:
        left, right = figure.subplots(1, 2, width_ratios=[1, 1.15])
        _draw_lift(left, data)
        _draw_coupling(right, data)
        style.save(figure, path, dpi=110)


def _draw_lift(axes: "Axes", data: LiftOff) -> None:
    side = np.linspace(-0.42, 0.42, 169)
    points = np.stack(np.meshgrid(side, side), axis=-1)
    lift = 100 * lift_map(data.scene, points)[0]
    image = axes.contourf(side, side, lift, levels=np.arange(0.0, 5.5, 0.5), cmap="Blues",
                          extend="min")  # fmt: skip
    axes.grid(visible=False)
    axes.figure.colorbar(image, ax=axes, label="lift / weight (%)", shrink=0.8)
    ring = data.scene.ring_sources()[0]
    axes.plot(ring[:, 0], ring[:, 1], ".", color=style.INK, ms=5, label="dipoles")
    axes.plot(*data.lift.place, "x", color=style.INK, ms=8, mew=2, label="largest lift")
    axes.plot(
        *data.first.place, "o", mfc="none", mew=2, color=style.INK, ms=9, label="first to leave"
    )
    axes.set(
        title="Lift in the unit reading, H = 0.2 m", xlabel="x (m)", ylabel="y (m)", aspect="equal"
    )
    axes.legend(loc="center", fontsize=8)


def _draw_coupling(axes: "Axes", data: LiftOff) -> None:
    axes.plot(
        data.heights, data.aligned, color=style.ORANGE, label="statics: largest lift = weight"
    )
    stays, leaves = data.brackets.T
    axes.plot(data.ran, np.sqrt(stays * leaves), "o", color=style.BLUE, label="runs begin to leave")
    readings = (
        (data.scene.coupling, "unit", 0.355, "right"),
        (Top.si().coupling, "SI", 0.045, "left"),
    )
    for coupling, name, x, side in readings:
        axes.axhline(coupling, color=style.GRAY, lw=1)
        axes.annotate(f"{name} reading", (x, coupling), (0, 3), ha=side,
                      textcoords="offset points")  # fmt: skip
    axes.plot(data.scene.ring_height, data.scene.coupling, "*", color=style.INK, ms=10)
    axes.annotate("the paper's top", (data.scene.ring_height, data.scene.coupling), (4, -13),
                  textcoords="offset points")  # fmt: skip
    note = "caught under\na dipole"
    axes.annotate(note, (0.045, 5e-5), (0, 3), textcoords="offset points")
    axes.set(yscale="log", xlabel="height H of the ring (m)", ylabel="coupling (J m³)")
    axes.set(title="Coupling at which the ball leaves the plane", xlim=(0.04, 0.36))
    axes.legend(loc="lower right")


FIGURE = Figure(
    name="lift_off",
    title="When the ball lifts off",
    caption=(
        "Left: the vertical magnetic force on the ball, with its axis along the field, divided"
        " by its weight, on the plane z = r (m = 0.2 kg, r = 1.8 cm, N = 20, r_ring = 34 cm, θ_R"
        " = π/64). The cross marks the maximum; the circle marks where a run leaves the plane at"
        " the smallest coupling at which any run does. Right: the coupling μ₀m²/4π at which this"
        " force equals the weight somewhere on the plane, and the coupling at which runs of 60 s"
        " from (-0.05, 0.02) m under gravity, c = 0.3 kg/s, begin to leave the plane. It is near"
        " the line under high rings, and far above it where a dipole of the higher side catches"
        " the ball first. In the unit reading of the paper's parameters, the coupling is 10⁻⁵ J"
        " m³ (10 A m² per dipole); in the SI reading, it is 10⁻³ J m³ (100 A m²). Statics means"
        " the vertical force on a ball at rest with its axis along the field."
    ),
    compute=compute,
    claims=claims,
    draw=draw,
    methods=(METHOD,),
)
