"""Where the top spins: its largest spin and where it settles, over the ring's height and tilt."""

from textwrap import fill

import xarray as xr

from magmotor.arguments import Picture, checked
from magmotor.plots import style
from magmotor.plots import sweep_panels as panels
from magmotor.plots.small_png import save_small
from magmotor.plots.sweep_axes import WRAP, meaning_of
from magmotor.scenes import Top
from magmotor.theory.top import highest_valley

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
    """
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
