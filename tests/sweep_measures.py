"""User-defined measures for tests of sweeps, which wait or kill their process."""

import os
import time


def waited(run, scene):
    """The final displacement, after waiting for 0.1 s."""
    time.sleep(0.1)
    return float(run.x[-1])


def fatal(run, scene):
    """Simulate a case that runs out of memory, if the noise is 3."""
    if scene.noise == 3:
        os._exit(9)
    return float(run.x[-1])


def broken(run, scene):
    return 1 / (scene.noise - 3)


def three(run, scene):
    return [1.0, 2.0, 3.0]
