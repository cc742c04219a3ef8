"""The effective potential V_e of the top: its cross-section, and its surface for three rings."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor import observables, theory
from magmotor.common import style
from magmotor.devices.top.scene import PAPER_TILT, Top
from magmotor.observables import CriticalPoint
from paper.bracket import bracket
from paper.figure import Claim, Figure, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Landscape:
    """V_e of a scene at some positions, in J, and all its critical points, deepest first."""

    scene: Top
    values: NDArray[np.float64]
    points: list[CriticalPoint]

    def of(self, kind: str) -> list[CriticalPoint]:
        """Return the critical points of a kind: minimum, saddle or maximum."""
        return [point for point in self.points if point.kind == kind]


def landscape(scene: Top, positions: ArrayLike) -> Landscape:
    """Compute V_e at positions on the plane, shape (..., 2), in m."""
    values = observables.effective_potential(scene, positions)
    return Landscape(scene, values, observables.critical_points(scene))


X = np.linspace(-0.5, 0.5, 401)
"""In m."""

LOWER, UPPER = (4.0e-3, 5.5e-3), (0.2, 0.35)
"""Tilts, in rad, between which the minimum becomes unique, and ceases to be unique."""

SLIGHT = PAPER_TILT / 5
"""A tilt, in rad, that is small compared with the paper's."""


def compute_sections(_quick: bool) -> list[Landscape]:
    """Compute the sections for the paper's ring, level and tilted by π/64."""
    line = np.stack([X, np.zeros_like(X)], axis=-1)
    return [landscape(scene, line) for scene in (Top.paper(3), Top.paper(4))]


def claims_of_the_sections(sections: list[Landscape]) -> list[Claim]:
    """Return the claims of (fig:potentialcrossection)."""
    level, tilted = sections
    asymmetry = float(np.abs(level.values - level.values[::-1]).max() / -level.values.min())
    around = [observables.valley_radius(level.scene, a) for a in np.linspace(0, np.pi, 61)]
    minima, saddles = tilted.of("minimum"), tilted.of("saddle")
    several, least = bracket(lambda tilt: not _is_unique(tilt), *LOWER, 1.01)
    most, again = bracket(_is_unique, *UPPER, 1.01)
    lowest_point, saddle = minima[0], saddles[-1]
    angle = (
        math.degrees(math.atan2(*saddle.position[::-1]) - math.atan2(*lowest_point.position[::-1]))
        % 360
    )
    return [
        judged(
            "With no tilt in the ring, the potential energy surface is axisymmetric and has a ring"
            " of minima",
            f"valley at ρ = {np.mean(around):.4f} m, to {1e6 * np.ptp(around):.0f} µm all around;"
            f" the section is symmetric to {asymmetry:.0e} of its depth",
            float(np.ptp(around)) < 1e-3 and asymmetry < 1e-6,
        ),
        judged(
            "If the ring is tilted slightly, a unique local minimum exists across from a saddle"
            " point",
            f"{len(minima)} minimum, {1e3 * lowest_point.energy:.3f} mJ at ρ ="
            f" {math.hypot(*lowest_point.position):.4f} m; {angle:.0f}° around from it, a saddle,"
            f" {1e3 * saddle.energy:.3f} mJ at ρ = {math.hypot(*saddle.position):.4f} m. The"
            " minimum"
            f" is unique from {math.degrees(least):.3f}° to {math.degrees(most):.1f}° of tilt;"
            f" below {math.degrees(several):.3f}° the ripple of 20 dipoles creates several, and"
            f" above {math.degrees(again):.1f}° the dipoles near the plane do",
            len(minima) == 1 and abs(angle - 180) < 1 and least < SLIGHT,
        ),
    ]


def _is_unique(tilt: float) -> bool:
    points = observables.critical_points(Top(tilt=tilt))
    return sum(point.kind == "minimum" for point in points) == 1


def draw_sections(sections: list[Landscape], path: Path) -> None:
    """Draw both sections and their critical points on the x axis."""
    markers = {"minimum": "v", "saddle": "X", "maximum": "^"}
    with style.figure(7.5, 4.6) as figure:
        axes = figure.subplots()
        for section, color in zip(sections, (style.BLUE, style.ORANGE), strict=True):
            tilted = section.scene.tilt > 0
            label = f"tilt {math.degrees(section.scene.tilt):.3g}°" if tilted else "no tilt"
            axes.plot(X, 1e3 * section.values, color=color, label=label)
            for point in section.points if tilted else ():
                if abs(point.position[1]) < 1e-6:
                    xy = point.position[0], 1e3 * point.energy
                    axes.plot(*xy, markers[point.kind], color=color, ms=9, mec="white")
                    axes.annotate(
                        point.kind, xy, (0, -16 if point.kind == "minimum" else 10),
                        textcoords="offset points", ha="center",
                    )  # fmt: skip
        axes.set(xlabel="x (m), on the line y = 0", ylabel="$V_e$ (mJ)", xlim=(X[0], X[-1]))
        axes.set_ylim(1.12 * 1e3 * min(float(s.values.min()) for s in sections), 0)
        axes.legend(loc="upper center", ncols=2)
        style.save(figure, path, dpi=100)


SECTION = Figure(
    "potential_section",
    "Cross-section of the potential energy surface",
    "V_e = -m|B|, the magnetic energy of a ball whose axis is along the field, on the line y ="
    " 0 under the top's ring. The ring is level, or tilted by π/64 (2.8°); the parameters are"
    " the paper's; ρ is the distance from the center.",
    compute_sections,
    claims_of_the_sections,
    draw_sections,
    (14,),
)


TILT = math.pi / 16
ORIENTATIONS = ((0.0, 0.0), (TILT, 0.0), (TILT, math.pi))
"""Tilt and azimuth in rad."""

GRID = np.linspace(-5.0, 5.0, 101)
"""As in the paper, whose numbers for this figure have no units."""

ALONG_X, ALONG_Y = "x (dimensionless)", "y (dimensionless)"

FINER, HIGHER = 40, 5.0
"""A finer ring's number of dipoles, and the height of a ring that leaves a minimum below it."""


@dataclass(frozen=True)
class Surfaces:
    """V_e of the figure's three rings, and the critical points of two others."""

    shown: list[Landscape]
    finer: list[CriticalPoint]
    higher: list[CriticalPoint]


def compute_surfaces(_quick: bool) -> Surfaces:
    """Compute V_e for the paper's caption: r = 0.3, H = 2, 25 dipoles, r_ring = 4."""
    plane = np.stack(np.meshgrid(GRID, GRID), axis=-1)
    level = Top(
        ball_radius=0.3, ring_height=2.0, ring_dipoles=25, ring_radius=4.0, tilt=0.0, coupling=1.0
    )
    shown = [
        landscape(level.replace(tilt=tilt, tilt_azimuth=azimuth), plane)
        for tilt, azimuth in ORIENTATIONS
    ]
    others = level.replace(ring_dipoles=FINER), level.replace(ring_height=HIGHER)
    return Surfaces(shown, *map(observables.critical_points, others))


def claims_of_the_surfaces(surfaces: Surfaces) -> list[Claim]:
    """Return the claims of (fig:potentialsurface) and of the remark before it."""
    level, tilted, mirrored = surfaces.shown
    deepest = tilted.of("minimum")
    depth = -level.of("minimum")[0].energy
    ripple, finer = _ripple(level.points), _ripple(surfaces.finer)
    center, below = _at_the_center(level.points), _at_the_center(surfaces.higher)
    x, y = deepest[0].position
    barrier = (tilted.of("saddle")[-1].energy - deepest[0].energy) / -deepest[0].energy
    deeper = -deepest[0].energy / depth - 1
    highest = theory.highest_valley(level.scene)
    return [
        judged(
            "The origin is an unstable critical point, since f has a local maximum at that point"
            " (the ring is above the ball)",
            f"with the figure's parameters the critical point at the origin is a {center}. But"
            f" under a ring higher than H = {highest:.2f} it is a {below} (at H = {HIGHER:g})",
            center == below == "maximum",
            otherwise="in part" if center == "maximum" else "wrong",
        ),
        judged(
            "Since f is axisymmetric this critical point is not a local minimum in the plane, but"
            " rather a circle of critical points",
            f"{len(level.of('minimum'))} minima and {len(level.of('saddle'))} saddles, due to a"
            f" ripple of {ripple:.1e} of the depth; {finer:.0e} with {FINER} dipoles: a circle as"
            " N → ∞, along which nothing drives the ball nor brings it back",
            ripple < 1e-3 and finer < 1e-2 * ripple,
        ),
        judged(
            "When the axisymmetry is broken by changing the orientation of the ring, there is a"
            " critical point that is a local minimum",
            f"{len(deepest)} {'minimum' if len(deepest) == 1 else 'minima'} (azimuth π:"
            f" {len(mirrored.of('minimum'))}, as 25 dipoles have no mirror image), the"
            f" deepest at ({x:.2f}, {abs(y):.2f}) and {100 * deeper:.0f} % deeper than without"
            f" tilt, {100 * barrier:.0f} % of its depth below the highest saddle",
            deeper > 0.1 and barrier > 100 * ripple,
        ),
    ]


def _ripple(points: list[CriticalPoint]) -> float:
    """Return the height of the saddles above the minima, over their depth."""
    depth = -points[0].energy
    return (max(point.energy for point in points if point.kind == "saddle") + depth) / depth


def _at_the_center(points: list[CriticalPoint]) -> str:
    """Return the kind of the critical point under the center of a level ring."""
    nearest = min(points, key=lambda point: math.hypot(*point.position))
    return nearest.kind if math.hypot(*nearest.position) < 1e-6 else "regular point"


def draw_surfaces(surfaces: Surfaces, path: Path) -> None:
    """Draw the three surfaces, and their level lines with all critical points."""
    lowest = min(float(surface.values.min()) for surface in surfaces.shown)
    with style.figure(12.6, 8.4) as figure:
        for number, surface in enumerate(surfaces.shown, start=1):
            axes: Any = figure.add_subplot(2, 3, number, projection="3d", computed_zorder=False)
            x, y = np.meshgrid(GRID, GRID)
            axes.plot_surface(
                x, y, surface.values, cmap="cividis", vmin=lowest, vmax=0, rstride=2, cstride=2,
                linewidth=0.2, edgecolor="#ffffff40",
            )  # fmt: skip
            _draw_levels(figure.add_subplot(2, 3, number + 3), surface, lowest)
            tilt, azimuth = surface.scene.tilt, surface.scene.tilt_azimuth
            angles = f"tilt {math.degrees(tilt):.4g}°, azimuth {math.degrees(azimuth):.0f}°"
            axes.set(xlabel=ALONG_X, ylabel=ALONG_Y, zlim=(1.05 * lowest, 0))
            # from the side of the higher rim, so that the deep part is visible
            axes.view_init(elev=48, azim=-102 if math.cos(azimuth) * tilt > 0 else -78)
            axes.set_title(f"({'abc'[number - 1]}) {angles}")
            axes.set_zticks([-2, -1, 0])
            axes.set_zlabel("$V_e$ / coupling")
            axes.set_box_aspect((1, 1, 0.65), zoom=0.95)
        style.save(figure, path, dpi=90, shaded=True)


def _draw_levels(axes: "Axes", surface: Landscape, lowest: float) -> None:
    levels = np.linspace(lowest, 0, 16)
    axes.contourf(GRID, GRID, surface.values, levels=levels, cmap="cividis")
    for kind, marker in (("minimum", "v"), ("saddle", "X"), ("maximum", "^")):
        x, y = zip(*(point.position for point in surface.of(kind)), strict=True)
        marker_style = {"color": style.ORANGE, "mec": "white", "ms": 8, "mew": 0.8}
        axes.plot(x, y, marker, ls="none", label=kind, **marker_style)
    axes.set(xlabel=ALONG_X, ylabel=ALONG_Y, aspect="equal", title="its levels and critical points")
    axes.grid(visible=False)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3)


SURFACE = Figure(
    "potential_surface",
    "Surface plot of V_e",
    "V_e = -|B| on the plane, divided by the coupling of a pair of dipoles, for the paper's r ="
    " 0.3, H = 2, 25 dipoles and r_ring = 4 (in one unit of length). The ring is level, or"
    " tilted by π/16 to either side. V_e is the magnetic energy of a ball whose axis is along"
    " the field B. Below: level lines of the same surfaces with all critical points.",
    compute_surfaces,
    claims_of_the_surfaces,
    draw_surfaces,
    (18,),
)

FIGURES = [SECTION, SURFACE]
