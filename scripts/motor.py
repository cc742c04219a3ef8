"""The command `magmotor motor`; the program is in `src/magmotor/commands/motor.py`."""

from magmotor.commands import main

if __name__ == "__main__":
    main("motor")
