"""Surface plots of the effective potential V_e, for the paper's three orientations of a ring."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from magmotor.common import style
from magmotor.common.style import save_small
from magmotor.devices.top.scene import Top
from paper.claim import Claim, judged
from paper.figure import Figure
from paper.top.landscape import Landscape, landscape

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TILT = math.pi / 16
ORIENTATIONS = ((0.0, 0.0), (TILT, 0.0), (TILT, math.pi))
"""Tilt and azimuth in rad."""

GRID = np.linspace(-5.0, 5.0, 101)
"""In m, in units of which the paper does not speak."""


def compute(_quick: bool) -> list[Landscape]:
    """V_e of the paper's caption: r = 0.3, H = 2, 25 dipoles, r_ring = 4."""
    surfaces = []
    plane = np.stack(np.meshgrid(GRID, GRID), axis=-1)
    for tilt, azimuth in ORIENTATIONS:
        scene = Top(
            ball_radius=0.3, ring_height=2.0, ring_dipoles=25, ring_radius=4.0, tilt=tilt,
            tilt_azimuth=azimuth, coupling=1.0,
        )  # fmt: skip
        surfaces.append(landscape(scene, plane))
    return surfaces


def claims(surfaces: list[Landscape]) -> list[Claim]:
    """Of (fig:potentialsurface) and the remark before it."""
    level, tilted, mirrored = surfaces
    minima, saddles, deepest = level.of("minimum"), level.of("saddle"), tilted.of("minimum")
    depth = -minima[0].energy
    ripple = (max(point.energy for point in saddles) + depth) / depth
    centre = min(level.points, key=lambda point: math.hypot(*point.position))
    x, y = deepest[0].position
    deeper = -deepest[0].energy / depth - 1
    return [
        judged(
            "Axisymmetric, the origin is an unstable critical point, a local maximum",
            f"the critical point at the origin is a {centre.kind}",
            centre.kind == "maximum" and math.hypot(*centre.position) < 1e-6,
        ),
        judged(
            "The other critical points are a circle, unstable along it",
            f"{len(minima)} minima and {len(saddles)} saddles, by a ripple of"
            f" {ripple:.1e} of the depth: a circle as N → ∞",
            ripple < 1e-3,
        ),
        judged(
            "By tilting the ring one can obtain a critical point which is a local minimum",
            f"{len(deepest)} {'minimum' if len(deepest) == 1 else 'minima'} (azimuth π:"
            f" {len(mirrored.of('minimum'))}, as 25 dipoles have no mirror image), the"
            f" deepest at ({x:.2f}, {abs(y):.2f}) and {100 * deeper:.0f} % deeper than without"
            " tilt",
            deeper > 0.1,
        ),
    ]


def draw(surfaces: list[Landscape], path: Path) -> None:
    """The three surfaces, and their levels with all critical points."""
    lowest = min(float(surface.values.min()) for surface in surfaces)
    with style.figure(12.6, 8.4) as figure:
        for number, surface in enumerate(surfaces, start=1):
            axes: Any = figure.add_subplot(2, 3, number, projection="3d", computed_zorder=False)
            x, y = np.meshgrid(GRID, GRID)
            axes.plot_surface(
                x, y, surface.values, cmap="cividis", vmin=lowest, vmax=0, rstride=2, cstride=2,
                linewidth=0.2, edgecolor="#ffffff40",
            )  # fmt: skip
            _draw_levels(figure.add_subplot(2, 3, number + 3), surface, lowest)
            tilt, azimuth = surface.scene.tilt, surface.scene.tilt_azimuth
            angles = f"tilt {math.degrees(tilt):.4g}°, azimuth {math.degrees(azimuth):.0f}°"
            axes.set(xlabel="x", ylabel="y", zlim=(1.05 * lowest, 0))
            # from the side of the higher rim, so that the deep part is seen
            axes.view_init(elev=48, azim=-102 if math.cos(azimuth) * tilt > 0 else -78)
            axes.set_title(f"({'abc'[number - 1]}) {angles}")
            axes.set_zticks([-2, -1, 0])
            axes.set_zlabel("$V_e$ / coupling")
            axes.set_box_aspect((1, 1, 0.65), zoom=0.95)
        save_small(figure, path, dpi=90, shaded=True)


def _draw_levels(axes: "Axes", surface: Landscape, lowest: float) -> None:
    levels = np.linspace(lowest, 0, 16)
    axes.contourf(GRID, GRID, surface.values, levels=levels, cmap="cividis")
    for kind, marker in (("minimum", "v"), ("saddle", "X"), ("maximum", "^")):
        x, y = zip(*(point.position for point in surface.of(kind)), strict=True)
        looks = {"color": style.ORANGE, "mec": "white", "ms": 8, "mew": 0.8}
        axes.plot(x, y, marker, ls="none", label=kind, **looks)
    axes.set(xlabel="x", ylabel="y", aspect="equal", title="its levels and critical points")
    axes.grid(visible=False)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3)


FIGURE = Figure(
    "potential_surface",
    "Surface plot of V_e",
    "V_e = -|B| on the plane for the paper's r = 0.3, H = 2, 25 dipoles, r_ring = 4 (in one unit of"
    " length), over the coupling of a pair of dipoles: level, and tilted by π/16 to either side."
    " V_e is the magnetic energy of a ball whose axis is along the field B. Below, the levels of"
    " the same surfaces with all critical points.",
    compute,
    claims,
    draw,
    (18,),
)
