"""The ring of dipoles and its field lines, for the paper's three orientations of the ring."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from magmotor import dipoles
from magmotor.common import style
from magmotor.devices.top.scene import Top
from paper.figure import Claim, Figure, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HEIGHT = 0.5
"""Height of the ring, in m, sufficient for the tilt."""

ORIENTATIONS = (("axisymmetric", 0.0, 0.0), ("tilted", math.pi / 4, 0.0),
                ("tilted", math.pi / 4, math.pi))  # fmt: skip
"""Name, tilt and azimuth, in rad."""

X, Z = np.linspace(-0.7, 0.7, 140), np.linspace(0.0, 1.0, 100)
"""Grid in the plane y = 0, in m; no dipole lies on it."""


@dataclass(frozen=True)
class Field:
    """One orientation: the scene and B, shape (100, 140, 3), on the plane y = 0, in tesla."""

    name: str
    scene: Top
    values: NDArray[np.float64]


def compute(_quick: bool) -> list[Field]:
    """Compute the field on the plane y = 0."""
    grid = np.stack(np.broadcast_arrays(X, 0.0, Z[:, np.newaxis]), axis=-1)
    fields = []
    for name, tilt, azimuth in ORIENTATIONS:
        scene = Top(tilt=tilt, tilt_azimuth=azimuth, ring_height=HEIGHT)
        values = dipoles.field(grid.reshape(-1, 3), *scene.ring_sources()).reshape(grid.shape)
        fields.append(Field(name, scene, values))
    return fields


def claims(fields: list[Field]) -> list[Claim]:
    """Return our claims on (fig:magfield), which makes none."""
    level, tilted, mirrored = (field.values for field in fields)
    out_of_plane = max(
        float(np.abs(b[..., 1] / np.linalg.norm(b, axis=-1)).max()) for b in (level, tilted)
    )
    mirror = tilted[:, ::-1] * [-1.0, 1.0, 1.0]
    difference = float(np.abs(mirrored - mirror).max() / np.abs(mirror).max())
    upward = dipoles.field(np.array([[0.0, 0.0, 0.1]]), *fields[0].scene.ring_sources())[0, 2]
    return [
        judged(
            "Ours: the field lines that start in the plane y = 0 stay in it, as the figure needs",
            f"|B_y| ≤ {out_of_plane:.0e} |B| there",
            out_of_plane < 1e-12,
        ),
        judged(
            "Ours: azimuth π tilts the ring to the other side",
            f"(c) is the mirror image of (b) to {difference:.0e} of the largest field",
            difference < 1e-12,
        ),
        judged(
            "Ours: the dipoles point outward, so that ξ₃ = +e_z is stable below the ring",
            f"B_z = {1e3 * upward:+.3f} mT on the axis, 0.1 m above the floor",
            upward > 0,
        ),
    ]


def draw(fields: list[Field], path: Path) -> None:
    """Draw field lines, the dipoles, and the ring's normal."""
    with style.figure(12.0, 3.6) as figure:
        panels = figure.subplots(1, 3, sharey=True)
        for letter, axes, field in zip("abc", panels, fields, strict=True):
            _draw(axes, field)
            tilt, azimuth = field.scene.tilt, field.scene.tilt_azimuth
            angles = f"tilt {math.degrees(tilt):.0f}°, azimuth {math.degrees(azimuth):.0f}°"
            axes.set_title(f"({letter}) {field.name}: {angles}")
        panels[0].set_ylabel("z (m)")
        panels[0].legend(loc="lower left")
        style.save(figure, path, dpi=90)


def _draw(axes: "Axes", field: Field) -> None:
    b_x, b_z = field.values[..., 0], field.values[..., 2]
    lines = {"color": style.BLUE, "linewidth": 0.7, "arrowsize": 0.7, "density": 1.5}
    axes.streamplot(X, Z, b_x, b_z, **lines)
    positions, moments = field.scene.ring_sources()
    directions = moments / field.scene.moment
    dipole_style = {"color": style.ORANGE, "zorder": 4}
    axes.plot(positions[:, 0], positions[:, 2], "o", ms=4, label="dipoles", **dipole_style)
    axes.quiver(
        positions[:, 0], positions[:, 2], directions[:, 0], directions[:, 2], angles="xy",
        scale_units="xy", scale=9, width=0.006, **dipole_style,
    )  # fmt: skip
    normal = 0.3 * np.array([math.sin(field.scene.tilt) * math.cos(field.scene.tilt_azimuth),
                             math.cos(field.scene.tilt)])  # fmt: skip
    axes.annotate(
        "ζ₃", (0, HEIGHT), (normal[0], HEIGHT + normal[1]), ha="center", va="center",
        arrowprops={"arrowstyle": "<-", "color": style.INK, "lw": 1.6}, zorder=5, fontsize=12,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
    )  # fmt: skip
    axes.set(xlabel="x (m)", xlim=(X[0], X[-1]), ylim=(Z[0], Z[-1]), aspect="equal")
    axes.grid(visible=False)


FIGURE = Figure(
    "field_lines",
    "The magnetized ring and its field",
    "Field lines of the top's ring in the plane y = 0 (20 outward dipoles at a radius of 0.34"
    " m, here 0.5 m high), with the ring's dipoles and its normal ζ₃; ξ₃ is the axis of the ball"
    " and of its dipole. The tilt is π/4, as in the paper's figure, far more than in the paper's"
    " simulations.",
    compute,
    claims,
    draw,
    (17,),
)
