"""The speed tables: ratios measured on this machine in one run, with their targets."""

import os
import platform
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the folder benchmarks

import magmotor as mm  # selects an OpenGL library, before a topic imports MuJoCo
from benchmarks.harness.command_line import Parser

TOPICS = (
    "magnetism", "callback", "minimal", "anatomy", "threads", "startup", "fixed_cost", "throughput",
    "disk_mujoco", "mujoco_baoab", "langevin", "ensemble", "rigid", "sweeps", "many", "fields",
    "levitation", "library", "shapes", "iron",
)  # fmt: skip
"""Modules in the folder speed."""

WITH_EXTRA = ("worlds",)
"""Those that need a package of the extra `warp`."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the program."""
    parser = Parser(prog="run.py", description=__doc__)
    parser.add_argument(
        "topics",
        nargs="*",
        metavar="TOPIC",
        help=f"by default {', '.join(TOPICS)}; with the extra warp, also {', '.join(WITH_EXTRA)}",
    )
    topics = parser.parse_args(arguments).topics or TOPICS
    for name in topics:
        if name not in TOPICS + WITH_EXTRA:
            known = ", ".join(TOPICS + WITH_EXTRA)
            parser.error(f"unknown topic {name!r}: known are {known}")
    begin = time.perf_counter()
    load, python = os.getloadavg()[0], platform.python_version()
    print(f"magmotor {mm.__version__}, MuJoCo {version('mujoco')}, Python {python}.")
    print(f"{os.cpu_count()} CPUs, of which {load:.1f} were busy in the last minute.")
    print("Times are minima over turns, since disturbances only add time. Repeat noisy rows.")
    for name in topics:
        import_module(f"benchmarks.speed.{name}").main()
    print(f"\n{time.perf_counter() - begin:.0f} s in all")


if __name__ == "__main__":
    main()
