"""The figures of the four sliding disks; the program is in `paper/disk/program.py`."""

import sys
from pathlib import Path

from magmotor.commands.output import run_program

sys.path.insert(0, str(Path(__file__).parents[1]))  # where the folder paper is
from paper.disk.program import main

if __name__ == "__main__":
    run_program(main)
