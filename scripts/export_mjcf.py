"""Write a scene as a standalone MJCF file, which any MuJoCo viewer can open.

The file contains the decorated scene, with the initial state as keyframe 0. As for any model that
declares them, magnetism, noise and potentials act inside `magmotor.magnetism()`.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import tyro
from command_line import parse, written_whole


@dataclass
class Options:
    path: tyro.conf.Positional[Path]
    """the file to write"""


def main() -> None:
    scene, options = parse(Options, __doc__ or "", ("top", "motor", "disk"))
    from magmotor.run.in_mujoco import compose

    text = plain(compose(scene, visual=True).to_xml_string())
    with written_whole(options.path) as part:
        part.write_text(text)
    print(f"wrote {options.path}")


def plain(text: str) -> str:
    """Shorten numbers to the digits that they need, and remove PyMJCF's placeholder names."""
    text = re.sub(r' (name="//unnamed[^"]*"|class="/"(?!>))', "", text)
    return re.sub(r"-?\d+\.\d+(e-?\d+)?", lambda number: repr(float(number[0])), text)


if __name__ == "__main__":
    main()
