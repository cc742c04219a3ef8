"""Pull of magnets: what vendors publish, this project's forces, and independent ones.

Published values are those of the page whose address stands beside them; most magnets with a thick
plate of steel. Thick steel is a plane here, and is judged by the closed forms of `pull_exact.py`;
sheets and the pot are judged by finite elements, `pull_elements.py`. The magnets have the middle
of the remanence of their grade, and lie on the steel without a gap unless one is given.

Run `python benchmarks/accuracy/pull.py`; the table is that of `docs/pull_forces.md`.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))  # for the folder benchmarks

import mujoco
import numpy as np

import magmotor as mm
from benchmarks.accuracy.pull_exact import pull_of_twin, pull_on_steel
from benchmarks.harness.command_line import Parser
from benchmarks.harness.tables import table

SUSCEPTIBILITY, SATURATION = 1000.0, 2.1 / (4e-7 * math.pi)
"""Of steel; the saturation magnetization in A/m."""

PAINT = 1e-4
"""Gap in m in front of sheets and below the pot: paint, plating and roughness."""

PLATE = 0.03
"""Radius of sheets in m."""

POT = {"diameter": 0.02, "bore": 0.017, "height": 0.006, "depth": 0.0045}
"""A cup of steel around a disk of 16 mm, in m."""

SQUARE = math.sqrt(math.pi) / 2
"""Side of a square over the diameter of a disk of the same area: MuJoCo has no tubes, so that the
pot and its magnet are square here."""

POUND, KILOGRAM = 4.4482, 9.8067
"""Weights in N."""

QUICKFIELD = "https://quickfield.com/advanced/{}.htm"  # its examples quote vendors, in pounds
DHIT = "https://dhit.pl/en/product/magnes-neodymowy-{}-n38-osiowy"
SUPERMAGNETE = (  # as a public project quotes it
    "https://www.supermagnete.de/eng/disc-magnets-neodymium/disc-magnet-10mm-3mm_S-10-03-N"
)
SUPERMAGNETE_FAQ = "https://ar.scribd.com/document/326585924/x-axis"  # a copy of its FAQ
APEX = "https://www.apexmagnets.com/news-how-tos/determine-pull-force-right-project/"

COLUMNS = ["magnet", "pulled to", "force", "right", "with paint", "published", "by", "ratio", "why"]


@dataclass(frozen=True)
class Case:
    """A magnet, what it is pulled to, and what is known of the pull in N.

    The target is `steel`, `twin`, `sheet`, `pot` (on thick steel) or `pot on a geom`. `thickness`
    is that of a sheet, `elements` is the result of `pull_elements.py`, and `why` names what makes
    the difference; `docs/pull_forces.md` explains it.
    """

    shape: str
    size: tuple[float, ...]
    grade: str
    target: str = "steel"
    gap: float = 0.0
    thickness: float = 0.0
    published: float | None = None
    vendor: str = ""
    page: str = ""
    elements: float | None = None
    why: str = ""

    @property
    def magnet(self) -> mm.Magnet:
        return mm.magnet(self.shape, np.array(self.size) * 1e-3, grade=self.grade)

    @property
    def right(self) -> float:
        """The independent value in N."""
        if self.elements is not None:
            return self.elements
        what = self.shape, self.magnet.size, self.magnet.remanence, self.gap
        return (
            pull_of_twin(*what) if self.target == "twin" else pull_on_steel(*what, SUSCEPTIBILITY)
        )

    def names(self) -> tuple[str, str]:
        """Return the magnet and the target in words."""
        size = " x ".join(f"{length:g}" for length in sorted(self.size, reverse=True))
        if self.shape == "ring":
            size = f"{self.size[1]:g}/{self.size[0]:g} x {self.size[2]:g}"
        elif self.shape == "cylinder":
            size = f"{self.size[0]:g} x {self.size[1]:g}"
        kind = {"cuboid": "block", "cylinder": "disk"}.get(self.shape, self.shape)
        target = {"sheet": f"a sheet of {self.thickness * 1e3:g} mm", "twin": "its twin",
                  "pot": "thick steel, in a pot", "pot on a geom": "a steel geom, in a pot",
                  "steel": "thick steel"}[self.target]  # fmt: skip
        distance = f", {self.gap * 1e3:g} mm away" if self.gap else ""
        return f"{kind} {size}, {self.grade}", target + distance


def _published() -> Iterator[Case]:
    """Yield what vendors publish; sizes are in mm."""
    for shape, size, grade, pounds, page, why in (
        ("sphere", (9.525,), "N42", 3.96, "spherical_permanent_magnet", "rating"),
        ("cylinder", (4.7625, 0.79375), "N40", 0.56, "disc_permanent_magnet_force", "gap"),
        ("cylinder", (50.8, 16.51), "N35", 112.3, "cylindrical_pm_ferromagnetic", "gap, recoil"),
        ("ring", (12.7, 50.8, 19.05), "N35", 122.4, "ring_pm_ferromagnetic", "gap, recoil"),
        ("cuboid", (38.1, 6.35, 6.35), "N35", 14.3, "block_pm_ferromagnetic", "gap, rating"),
    ):
        vendor = "unnamed" if grade == "N40" else "K&J"
        force, address = pounds * POUND, QUICKFIELD.format(page)
        yield Case(shape, size, grade, published=force, vendor=vendor, page=address, why=why)
    yield Case("cylinder", (10.0, 3.0), "N42", published=17.7, vendor="supermagnete",
               page=SUPERMAGNETE, why="gap, recoil")  # fmt: skip
    yield Case("cylinder", (25.4, 3.175), "N48", published=12.2 * POUND, vendor="Apex",
               page=APEX, why="gap, rating")  # fmt: skip
    for shape, size, force, page, why in (
        ("ring", (10.0, 20.0, 5.0), 50.97, "pierscieniowy-20x10x5", "hole"),
        ("ring", (5.0, 12.0, 2.0), 11.29, "pierscieniowy-12x5x2", "hole"),
        ("cuboid", (20.0, 10.0, 5.0), 60.31, "plytkowy-20x10x5", ""),
        ("cuboid", (10.0, 5.0, 1.5), 8.47, "plytkowy-10x5x1-5", "gap"),
        ("cuboid", (42.0, 20.0, 5.0), 108.46, "plytkowy-42x20x5", "gap, rating"),
    ):
        yield Case(shape, size, "N38", published=force, vendor="Dhit",
                   page=DHIT.format(page), why=why)  # fmt: skip
    for gap, weight in ((0.0, 78), (0.01, 30), (0.02, 15), (0.04, 5)):
        yield Case("cylinder", (45.0, 30.0), "N45", "twin", gap, vendor="supermagnete",
                   published=weight * KILOGRAM, page=SUPERMAGNETE_FAQ,
                   why="recoil, remanence")  # fmt: skip


def _judged() -> Iterator[Case]:
    """Yield what no vendor was found to publish; sizes are in mm."""
    small, large = ("cylinder", (10.0, 3.0)), ("cylinder", (20.0, 5.0))
    flat = "cylinder", (25.4, 3.175)
    in_pot = (round(16 * SQUARE, 2), round(16 * SQUARE, 2), 4.5)
    yield Case("cuboid", (20.0, 10.0, 5.0), "N38", "twin")
    for gap in (0.001, 0.002, 0.005):
        yield Case(*small, "N42", gap=gap)
    for magnet, thickness, force, why in (
        (small, 0.001, 19.22, ""), (small, 0.0005, 11.77, ""), (large, 0.002, 71.59, ""),
        (large, 0.001, 46.25, ""), (large, 0.0005, 23.09, ""), (flat, 0.0003, 12.64, "saturation"),
    ):  # fmt: skip
        yield Case(*magnet, "N42", "sheet", PAINT, thickness, elements=force, why=why)
    for gap, force, on_plane in ((PAINT, 192.4, "iron meets iron"), (0.002, 23.51, "")):
        for target, why in (("pot", on_plane), ("pot on a geom", "iron meets iron")):
            yield Case("cuboid", in_pot, "N42", target, gap, elements=force, why=why)


CASES = [*_published(), *_judged()]


def pull(case: Case) -> float:
    """Return this project's force in N, toward the target below."""
    steel = f"{SUSCEPTIBILITY:g} {SATURATION:.8g}" if case.elements else f"{SUSCEPTIBILITY:g}"
    target, iron = _target(case)
    cup = _cup() if case.target.startswith("pot") else []
    iron += [f"cup_{k}" for k in range(len(cup))]
    named = "".join(f'<element objtype="geom" objname="{name}"/>' for name in iron)
    height = case.magnet.size[-1]
    custom = f"""
      <numeric name="steel" data="{steel}"/>
      <tuple name="iron"><element objtype="numeric" objname="steel"/>{named}</tuple>"""
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option gravity="0 0 0"/>
      <custom><text name="magmotor" data="magnets iron"/>{custom if iron else ""}</custom>
      <worldbody>
        {target}
        <body name="magnet" pos="0 0 {case.gap + height / 2}"><freejoint/>
          {case.magnet.mjcf()}{"".join(cup)}</body>
      </worldbody>
    </mujoco>""")
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return -data.xfrc_applied[model.body("magnet").id, 2]


def _target(case: Case) -> tuple[str, list[str]]:
    """Return the target as MJCF, its surface at z = 0, and the name of its geom if it is iron."""
    if case.target == "twin":
        height = case.magnet.size[-1]
        return f'<body pos="0 0 {-height / 2}"><freejoint/>{case.magnet.mjcf()}</body>', []
    if case.target in ("steel", "pot"):
        return '<geom name="steel" type="plane" size="1 1 1"/>', ["steel"]
    half = (case.thickness or 0.01) / 2
    size = f'type="cylinder" size="{PLATE} {half}" pos="0 0 {-half}"'
    return f'<geom name="steel" {size}/>', ["steel"]


def _cup() -> list[str]:
    """Return a cup of boxes around the center of its magnet, as MJCF."""
    side, bore = (SQUARE * POT[name] for name in ("diameter", "bore"))
    floor, depth, wall = POT["height"] - POT["depth"], POT["depth"], (side - bore) / 2
    boxes = [(0, 0, (depth + floor) / 2, side, side, floor)]
    boxes += [(s * (bore + wall) / 2, 0, 0, wall, side, depth) for s in (1, -1)]
    boxes += [(0, s * (bore + wall) / 2, 0, bore, wall, depth) for s in (1, -1)]
    return [
        f'<geom name="cup_{k}" type="box" pos="{x} {y} {z}" size="{u / 2} {v / 2} {w / 2}"/>'
        for k, (x, y, z, u, v, w) in enumerate(boxes)
    ]


def row(case: Case) -> list[str]:
    """Return the cells of a case; forces are in N."""
    force, published, painted, by, ratio = pull(case), "", "", "", ""
    if case.published:
        published, ratio = _digits(case.published), f"{force / case.published:.2f}"
        by = f"[{case.vendor}]({case.page})"
        painted = "" if case.gap else _digits(pull(replace(case, gap=PAINT)))
    numbers = [_digits(force), _digits(case.right), painted, published]
    return [*case.names(), *numbers, by, ratio, case.why]


def _digits(force: float) -> str:
    """Return three digits of a force."""
    return f"{force:#.3g}".rstrip(".")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the program."""
    parser = Parser(prog="pull.py", description=__doc__)
    parser.add_argument(
        "--elements", action="store_true", help="print the finite elements' forces (needs NGSolve)"
    )
    if not parser.parse_args(arguments).elements:
        print(table(COLUMNS, map(row, CASES)))
        return
    try:
        from benchmarks.accuracy.pull_elements import show
    except ImportError as error:
        parser.error(f"{error}: install ngsolve 6.2")
    show()


if __name__ == "__main__":
    main()
