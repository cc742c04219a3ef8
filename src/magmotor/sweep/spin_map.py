"""Where the top spins: a sweep over tilt and height."""

import json
from textwrap import fill

import xarray as xr

from magmotor.common import style
from magmotor.common.arguments import Picture, checked
from magmotor.common.checks import reject
from magmotor.common.style import save_small
from magmotor.devices.top.scene import Top
from magmotor.devices.top.theory import highest_valley
from magmotor.sweep import plots as panels
from magmotor.sweep.plots import WRAP, meaning_of

MEASURES, FIELDS = ("max_spin", "settling_radius"), ("tilt", "ring_height")

LINE = "(H − r)/R = 0.980: above, a level ring keeps the ball under its centre"


@checked
def spin_map(data: xr.Dataset, scene: Top, path: Picture) -> None:
    """Write the picture of a sweep of the top over `tilt` and `ring_height`.

    Parameters
    ----------
    data : xarray.Dataset
        The combined sweep, with the measures `max_spin` and `settling_radius`.
    scene : Top
        What did not vary.
    path : str or Path
        The .png to write.

    Raises
    ------
    ValueError
        It is no such sweep, or that of another scene.
    """
    _check(data, scene)
    with style.figure(9.6, 4.2) as figure:
        left, right = figure.subplots(1, 2)
        for axes, name in ((left, "max_spin"), (right, "settling_radius")):
            axes.set_title(fill(meaning_of(data[name]), WRAP))
            shown = panels.averaged(data[name])
            panels.draw_map(axes, shown, data.tilt, data.ring_height)
            axes.axhline(highest_valley(scene), color=style.ORANGE, ls="--", label=LINE)
        legend = left.get_legend_handles_labels()
        figure.legend(*legend, loc="outside lower center", ncols=2)
        save_small(figure, path, dpi=100)


def _check(data: xr.Dataset, scene: Top) -> None:
    needs = *MEASURES, *FIELDS
    missing = [name for name in needs if name not in data or data[name].dtype.kind not in "iuf"]
    if missing or any(data[name].dims != (name,) for name in FIELDS):
        bound = f"those of a sweep of {' and '.join(FIELDS)} that measures {' and '.join(MEASURES)}"
        raise reject("variables of data", [*map(str, data.variables)], bound)
    if "sweep" in data.attrs:
        own = json.loads(data.attrs["sweep"]).get("scene_fields", {})
        for name in ("ball_radius", "ring_radius"):
            value = getattr(scene, name)
            if own.get(name, value) != value:
                raise reject(f"scene.{name}", value, f"{own[name]!r}, as in the sweep")
