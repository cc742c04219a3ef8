"""`python -m magmotor` is the command `magmotor`."""

from magmotor.command_line import main

main()
