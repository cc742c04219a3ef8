"""The command `magmotor sweep`; the program is in `src/magmotor/commands/sweep.py`."""

from magmotor.commands import main

if __name__ == "__main__":
    main("sweep")
