"""The map of a sweep of the top: its largest spin, and where it settles."""

import xarray as xr

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.hints import Dpi, Picture
from magmotor.common.measure_panels import averaged, draw_map
from magmotor.devices.top.scene import Top
from magmotor.devices.top.theory import highest_valley

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
    """
    with style.figure(9.6, 4.2) as figure:
        left, right = figure.subplots(1, 2)
        for axes, name in ((left, "max_spin"), (right, "settling_radius")):
            shown = averaged(data[name])
            draw_map(axes, shown, data.tilt, data.ring_height)
            axes.axhline(highest_valley(scene), color=style.ORANGE, ls="--", label=LINE)
        legend = left.get_legend_handles_labels()
        figure.legend(*legend, loc="outside lower center", ncols=2)
        style.save(figure, path, dpi)
