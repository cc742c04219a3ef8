"""Measures of users' own, for the tests of sweeps: they wait, or kill their process."""

import os
import time


def waited(run, scene):
    """0.1 s of work that needs no processor; the final displacement."""
    time.sleep(0.1)
    return float(run.x[-1])


def fatal(run, scene):
    """What a case does that runs out of memory, where the noise is 3."""
    if scene.noise == 3:
        os._exit(9)
    return float(run.x[-1])


def broken(run, scene):
    return 1 / (scene.noise - 3)


def three(run, scene):
    return [1.0, 2.0, 3.0]
