"""The map of a sweep of the top: its largest spin, and where it settles."""

import json

import xarray as xr

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.common.hints import Dpi, Picture
from magmotor.common.measure_panels import averaged, draw_map
from magmotor.devices.top.scene import Top
from magmotor.devices.top.theory import highest_valley

MEASURES, FIELDS = ("max_spin", "settling_radius"), ("tilt", "ring_height")

LINE = "(H − r)/R = 0.980: above, a level ring keeps the ball under its center"


@checked
def spin_map(data: xr.Dataset, scene: Top, path: Picture, dpi: Dpi = style.DPI) -> None:
    """Draw the results of a sweep of the top over `tilt` and `ring_height`.

    Parameters
    ----------
    data : xarray.Dataset
        The combined sweep, with the measures `max_spin` and `settling_radius`.
    scene : Top
        The scene that was swept.
    path : str or Path
        The file to write; its suffix sets the format.
    dpi : int
        Dots per inch of the picture.

    Raises
    ------
    ValueError
        The data are not from such a sweep, or are from a sweep of another scene.
    """
    _check(data, scene)
    with style.figure(9.6, 4.2) as figure:
        left, right = figure.subplots(1, 2)
        for axes, name in ((left, "max_spin"), (right, "settling_radius")):
            shown = averaged(data[name])
            draw_map(axes, shown, data.tilt, data.ring_height)
            axes.axhline(highest_valley(scene), color=style.ORANGE, ls="--", label=LINE)
        legend = left.get_legend_handles_labels()
        figure.legend(*legend, loc="outside lower center", ncols=2)
        style.save(figure, path, dpi)


def _check(data: xr.Dataset, scene: Top) -> None:
    needs = *MEASURES, *FIELDS
    missing = [name for name in needs if name not in data or data[name].dtype.kind not in "iuf"]
    if missing or any(data[name].dims != (name,) for name in FIELDS):
        swept, measured = " and ".join(FIELDS), " and ".join(MEASURES)
        sentence = f"must come from a sweep over {swept} that measures {measured}"
        raise reject("variables of data", [*map(str, data.variables)], sentence)
    if "sweep" in data.attrs:
        own = json.loads(data.attrs["sweep"]).get("scene_fields", {})
        for name in ("ball_radius", "ring_radius"):
            value = getattr(scene, name)
            if own.get(name, value) != value:
                raise reject(f"scene.{name}", value, f"must be {own[name]!r}, as in the sweep")
