"""The command `magmotor disk`; the program is in `src/magmotor/commands/disk.py`."""

from magmotor.commands import main

if __name__ == "__main__":
    main("disk")
