"""Cross-section of the effective potential of the top, with and without tilt."""

import math
from pathlib import Path

import numpy as np

from magmotor import observables
from magmotor.common import style
from magmotor.common.style import save_small
from magmotor.devices.top.scene import PAPER_TILT, Top
from paper.bracket import bracket
from paper.claim import Claim, judged
from paper.figure import Figure
from paper.top.landscape import Landscape, landscape

X = np.linspace(-0.5, 0.5, 401)
"""In m."""

LOWER, UPPER = (4.0e-3, 5.5e-3), (0.2, 0.35)
"""Tilts in rad between which the minimum becomes unique, and ceases to be."""

SLIGHT = PAPER_TILT / 5
"""A tilt, in rad, that is slight beside the paper's."""


def compute(_quick: bool) -> list[Landscape]:
    """The sections of the paper's ring, level and tilted by π/64."""
    line = np.stack([X, np.zeros_like(X)], axis=-1)
    return [landscape(scene, line) for scene in (Top.paper(3), Top.paper(4))]


def claims(sections: list[Landscape]) -> list[Claim]:
    """Of (fig:potentialcrossection)."""
    level, tilted = sections
    asymmetry = float(np.abs(level.values - level.values[::-1]).max() / -level.values.min())
    around = [observables.valley_radius(level.scene, a) for a in np.linspace(0, np.pi, 61)]
    minima, saddles = tilted.of("minimum"), tilted.of("saddle")
    several, least = bracket(lambda tilt: not _is_unique(tilt), *LOWER, 1.01)
    most, again = bracket(_is_unique, *UPPER, 1.01)
    low, pass_ = minima[0], saddles[-1]
    angle = math.degrees(math.atan2(*pass_.position[::-1]) - math.atan2(*low.position[::-1])) % 360
    return [
        judged(
            "With no tilt the surface is axisymmetric and has a ring of minima",
            f"valley at ρ = {np.mean(around):.4f} m, to {1e6 * np.ptp(around):.0f} µm all round;"
            f" the section is symmetric to {asymmetry:.0e} of its depth",
            float(np.ptp(around)) < 1e-3 and asymmetry < 1e-6,
        ),
        judged(
            "Tilted slightly, a unique local minimum exists across from a saddle point",
            f"{len(minima)} minimum, {1e3 * low.energy:.3f} mJ at ρ ="
            f" {math.hypot(*low.position):.4f} m; {angle:.0f}° round, a saddle,"
            f" {1e3 * pass_.energy:.3f} mJ at ρ = {math.hypot(*pass_.position):.4f} m. The minimum"
            f" is unique from {math.degrees(least):.3f}° to {math.degrees(most):.1f}° of tilt; up"
            f" to {math.degrees(several):.3f}° the ripple of 20 dipoles makes several, from"
            f" {math.degrees(again):.1f}° on the dipoles near the plane do",
            len(minima) == 1 and abs(angle - 180) < 1 and least < SLIGHT,
        ),
    ]


def _is_unique(tilt: float) -> bool:
    points = observables.critical_points(Top(tilt=tilt))
    return sum(point.kind == "minimum" for point in points) == 1


def draw(sections: list[Landscape], path: Path) -> None:
    """Both sections and their critical points on the x axis."""
    markers = {"minimum": "v", "saddle": "X", "maximum": "^"}
    with style.figure(7.5, 4.6) as figure:
        axes = figure.subplots()
        for section, colour in zip(sections, (style.BLUE, style.ORANGE), strict=True):
            tilted = section.scene.tilt > 0
            label = f"tilt {math.degrees(section.scene.tilt):.3g}°" if tilted else "no tilt"
            axes.plot(X, 1e3 * section.values, color=colour, label=label)
            for point in section.points if tilted else ():
                if abs(point.position[1]) < 1e-6:
                    place = point.position[0], 1e3 * point.energy
                    axes.plot(*place, markers[point.kind], color=colour, ms=9, mec="white")
                    axes.annotate(
                        point.kind, place, (0, -16 if point.kind == "minimum" else 10),
                        textcoords="offset points", ha="center",
                    )  # fmt: skip
        axes.set(xlabel="x (m), on the line y = 0", ylabel="$V_e$ (mJ)", xlim=(X[0], X[-1]))
        axes.set_ylim(1.12 * 1e3 * min(float(s.values.min()) for s in sections), 0)
        axes.legend(loc="upper center", ncols=2)
        save_small(figure, path, dpi=100)


FIGURE = Figure(
    "potential_section",
    "Cross-section of the potential energy surface",
    "V_e = -m|B|, the magnetic energy of a ball whose axis is along the field, on the line y = 0"
    " under the top's ring, level and tilted by π/64 (2.8°), with the paper's parameters; ρ is the"
    " distance from the centre.",
    compute,
    claims,
    draw,
    (14,),
)
