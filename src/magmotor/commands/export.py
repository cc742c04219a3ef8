"""Write a scene as a standalone MJCF file or as TOML, or a dataset as a table.

The ending of the file says what it will be. TOML (.toml) lists all fields of the scene with their
units; the option --scene of this and other commands reads it.

MJCF (.xml) is decorated and in its initial state, which is keyframe 0. Magnetism, noise and
potentials act on the model inside `magmotor.magnetism()`. To make them act in MuJoCo's viewer,
include the file in another one with the plugin, as `models/top_magnetic.xml` includes `top.xml`.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import tyro

import magmotor as mm
from magmotor.commands.output import MISTAKE, fail, read_netcdf, written_whole
from magmotor.commands.scene_options import parse
from magmotor.common.exceptions import ArgumentError
from magmotor.run.scene_file import toml_of

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


SCENE_FILES = (".xml", ".toml")


@dataclass
class Options:
    path: tyro.conf.Positional[Path]
    """the file to write, which ends in .xml or .toml"""


@dataclass
class RunOptions:
    """Write a dataset as a table (.csv, .parquet), or its scene as MJCF or TOML (.xml, .toml).

    A table has one row for each record, replica or case, and one column for each component. The
    first line of a CSV file is a comment with the units.
    """

    dataset: tyro.conf.Positional[Path]
    """a run, an ensemble or a combined sweep, in netCDF"""
    path: tyro.conf.Positional[Path]
    """the file to write; its ending says what"""
    rows: str | None = None
    """the table's dimensions, separated by commas; by default those of the first variable"""


def main() -> None:
    kinds = {**dict.fromkeys(("top", "motor", "disk"), Options), "run": RunOptions}
    scene, options = parse(kinds, __doc__ or "", tuple(kinds))
    try:
        if isinstance(options, RunOptions):
            export_dataset(options)
        else:
            export_scene(scene, options.path)
    except ValueError as error:
        fail(str(error), MISTAKE)
    print(f"wrote {options.path}")


def export_dataset(options: RunOptions) -> None:
    from magmotor.run.to_table import TABLE_FILES, check_table_file, to_table, write_table

    is_table = options.path.suffix.lower() not in SCENE_FILES
    if options.path.suffix.lower() not in (*TABLE_FILES, *SCENE_FILES):
        sentence = "must end in .csv or .parquet for a table, in .xml or .toml for the scene"
        raise ArgumentError("path", str(options.path), sentence)
    if is_table:
        check_table_file(options.path)
    elif options.rows is not None:
        raise ArgumentError("rows", options.rows, "must be left out, since a scene is not a table")
    data = read_netcdf(options.dataset)
    if not is_table:
        if "sweep" in data.attrs:
            raise ArgumentError(
                "dataset", str(options.dataset), "must have one scene, unlike a sweep"
            )
        export_scene(mm.scene_of(data), options.path)
        return
    table = to_table(data, rows=None if options.rows is None else options.rows.split(","))
    for name in table.attrs["left_out"]:
        print(f"left out: {name} ({', '.join(map(str, data[name].dims))})")
    with written_whole(options.path) as part:
        write_table(table, part)


def export_scene(scene: Any, path: Path) -> None:
    if path.suffix.lower() not in SCENE_FILES:
        raise ArgumentError("path", str(path), "must end in .xml or .toml")
    text = toml_of(scene) if path.suffix.lower() == ".toml" else mjcf_of(scene)
    with written_whole(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def mjcf_of(scene: Any) -> str:
    from magmotor.mjcf.model_parts import xml_of
    from magmotor.run.in_mujoco import compose

    si = scene.device.time_unit == "s"
    units = "SI units; angles in radians" if si else "dimensionless, with the paper's scales"
    return readable(xml_of(compose(scene, visual=True)), f"{type(scene).__name__}: {units}")


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
