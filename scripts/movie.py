"""The command `magmotor movie`; the program is in `src/magmotor/commands/movie.py`."""

from magmotor.commands import main

if __name__ == "__main__":
    main("movie")
