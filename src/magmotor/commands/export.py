"""Write a scene as a standalone MJCF file, decorated and in its initial state.

The initial state is keyframe 0. Magnetism, noise and potentials act on the model inside
`magmotor.magnetism()`. To make them act in MuJoCo's viewer, include the file in another one with
the plugin, as `models/top_magnetic.xml` includes `top.xml`.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import tyro

from magmotor.commands.output import written_whole
from magmotor.commands.scene_options import parse

ORDER = [
    "compiler",
    "option",
    "size",
    "visual",
    "statistic",
    "default",
    "custom",
    "asset",
    "worldbody",
    "contact",
    "tendon",
    "keyframe",
    "inertial",
    "joint",
    "freejoint",
    "geom",
    "site",
    "camera",
    "light",
    "body",
]
"""Elements in the order in which MJCF is usually written; others come last."""


@dataclass
class Options:
    path: tyro.conf.Positional[Path]
    """the file to write"""


def main() -> None:
    scene, options = parse(Options, __doc__ or "", ("top", "motor", "disk"))
    from magmotor.mjcf.parts import xml_of
    from magmotor.run.in_mujoco import compose

    si = scene.device.time_unit == "s"
    units = "SI units; angles in radians" if si else "dimensionless, with the paper's scales"
    text = readable(xml_of(compose(scene, visual=True)), f"{type(scene).__name__}: {units}")
    with written_whole(options.path) as part:
        part.write_text(text)
    print(f"wrote {options.path}")


def readable(text: str, title: str) -> str:
    """The same MJCF in the usual order, with the shortest digits of its numbers, and comments."""
    text = re.sub(r' class="/"(?!>)', "", text)
    text = re.sub(r"-?\d+\.\d+(e-?\d+)?", lambda number: repr(float(number[0])), text)
    root = ElementTree.fromstring(text)
    for defaults in root.findall("default"):  # PyMJCF has the main class inside a nameless one
        defaults[:] = [inner for outer in defaults for inner in outer]
    for element in list(root.iter()):
        element[:] = sorted(element, key=_rank)
        seen = ""
        for child in list(element):
            comment = _comment(child)
            if comment != seen and comment:
                element.insert(list(element).index(child), ElementTree.Comment(f" {comment} "))
            seen = comment
    root.insert(0, ElementTree.Comment(f" {title} "))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode").replace(" />", "/>") + "\n"


def _rank(element: ElementTree.Element) -> int:
    return ORDER.index(element.tag) if element.tag in ORDER else len(ORDER)


def _comment(element: ElementTree.Element) -> str:
    """What an element's numbers mean where MuJoCo does not define it; empty for most."""
    kind, name = element.tag, element.get("name", "")
    if kind == "site" and element.get("class") == "dipole":
        return "dipoles along the z axes of sites; user: moment (A m^2)"
    if kind == "body" and element.get("user"):
        return (
            "user: rows of six, each a Brownian force x y z (N s^1/2) and torque x y z (N m s^1/2)"
        )
    if kind == "joint" and element.get("user"):
        return "user: a_1 b_1 a_2 b_2 ... of U(q) = sum_k a_k sin kq + b_k cos kq (J)"
    if kind == "tuple" and name.startswith("coupling"):
        return "the dipoles of these bodies act on one another prm times as strongly"
    if kind == "pair" and name == "viscous":
        return "viscous slip: force -c V on the contact point, calibrated by solreffriction"
    if kind == "key":
        return "the initial state"
    return ""
