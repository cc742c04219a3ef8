"""The command `magmotor view`; the program is in `src/magmotor/commands/view.py`."""

from magmotor.commands import main

if __name__ == "__main__":
    main("view")
