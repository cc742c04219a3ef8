"""The figures of the seven motors; the program is in `paper/motor/program.py`."""

import sys
from pathlib import Path

from magmotor.commands.output import run_program

sys.path.insert(0, str(Path(__file__).parents[1]))  # where the folder paper is
from paper.motor.program import main

if __name__ == "__main__":
    run_program(main)
