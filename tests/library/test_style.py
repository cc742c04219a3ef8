"""Pictures: methods look alike everywhere, also to the color-blind; formats and dots."""

from itertools import combinations

import matplotlib
import mujoco
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image
from refusals import refused

import magmotor as mm
from magmotor.common import style
from paper.disk.system import SYSTEMS

SEEN = {
    "normally": np.eye(3),
    "with protanopia": np.array(
        [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]]
    ),
    "with deuteranopia": np.array(
        [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]
    ),
}
"""How linear RGB is seen: Machado, Oliveira and Fernandes 2009, table 1, severity 1."""

TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = TO_XYZ.sum(axis=1)


def lab(color, sight):
    """Return CIE L*a*b* of a color as it is seen."""
    rgb = np.array(to_rgb(color))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    x, y, z = np.cbrt(TO_XYZ @ np.clip(SEEN[sight] @ linear, 1e-3, 1) / WHITE)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def least_distance(colors, sight):
    """Return the smallest CIE76 difference of two colors; one can just see a difference of 2."""
    seen = [lab(color, sight) for color in colors]
    return min(float(np.linalg.norm(a - b)) for a, b in combinations(seen, 2))


def names():
    scenes = (mm.Top(), mm.Disk(), mm.Motor(), mm.LangevinParticle())
    own = {method for scene in scenes for method in mm.methods(scene)}
    members = (name.removeprefix("mjINT_") for name in mujoco.mjtIntegrator.__members__)
    return sorted(own | {f"mujoco/{name.lower()}" for name in members})


def test_every_method_has_a_look_of_its_own():
    looks = [tuple(style.method_look(name).values()) for name in names()]
    assert {name.split("/")[1] for name in names()} <= style.SCHEMES.keys()
    assert len(set(looks)) == len(looks) == len(names())
    assert len({marker for _, marker in style.SCHEMES.values()}) == len(style.SCHEMES)
    both = [style.method_look(f"{engine}/baoab") for engine in ("mujoco", "variational")]
    assert both[0]["color"] == both[1]["color"] != both[1]["mfc"]


@pytest.mark.parametrize("sight", SEEN)
def test_the_colors_differ_to_the_color_blind(sight):
    schemes = [color for color, _ in style.SCHEMES.values()]
    assert least_distance(schemes, sight) > 12  # 22, 14, 13
    systems = [color for color, _ in SYSTEMS.values()]
    assert least_distance(systems, sight) > 16  # 53, 23, 18


@pytest.mark.parametrize("sight", SEEN)
def test_the_basins_of_the_pendulum_differ_to_the_color_blind_in_any_shade(sight):
    cycle = rc_params_from_style()["axes.prop_cycle"].by_key()["color"][:3]
    shades = [
        [lab(shade * np.array(to_rgb(color)), sight) for shade in np.linspace(0.45, 1, 8)]
        for color in cycle
    ]
    apart = min(
        float(np.linalg.norm(a - b))
        for one, other in combinations(shades, 2)
        for a in one
        for b in other
    )
    assert apart > 20  # 36, 27, 29


def rc_params_from_style():
    with matplotlib.rc_context(mm.plots.STYLE):
        return matplotlib.rcParams.copy()


@pytest.fixture(scope="module")
def run():
    return mm.simulate(mm.Top(), method="variational/verlet", timestep=0.1, duration=5.0)


@pytest.mark.parametrize(("suffix", "begins"), [("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_the_suffix_sets_the_format(run, tmp_path, suffix, begins):
    path = tmp_path / f"top.{suffix}"
    mm.plots.overview(run, None, path)
    assert path.read_bytes().startswith(begins)


def test_dpi_sets_the_size_and_is_checked(run, tmp_path):
    path = tmp_path / "top.png"
    mm.plots.overview(run, None, path, dpi=30)
    with Image.open(path) as picture:
        assert picture.format == "PNG"
        assert picture.size == (330, 165)
        assert picture.info["dpi"] == pytest.approx((30, 30), abs=0.1)  # 0.01: a PNG's unit
    with refused("dpi"):
        mm.plots.overview(run, None, path, dpi=5)
