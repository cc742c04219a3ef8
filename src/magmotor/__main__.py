"""`python -m magmotor` is the command `magmotor`."""

from magmotor.commands import main

if __name__ == "__main__":
    main()
