"""The command `magmotor rerun`; the program is in `src/magmotor/commands/rerun.py`."""

from magmotor.commands import main

if __name__ == "__main__":
    main("rerun")
