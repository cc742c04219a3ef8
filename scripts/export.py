"""The command `magmotor export`; the program is in `src/magmotor/commands/export.py`."""

from magmotor.commands import main

if __name__ == "__main__":
    main("export")
