"""User-defined measures for the tests of sweeps: they wait, fail, or kill their process."""

import errno
import os
import time

full = True
"""Whether the disk to which `saved` writes is full."""


def waited(run, scene):
    """Return the final displacement after 0.1 s that need no processor."""
    time.sleep(0.1)
    return float(run.x[-1])


def fatal(run, scene):
    """End the process where the noise is 3, like a case that runs out of memory."""
    if scene.noise == 3:
        os._exit(9)
    return float(run.x[-1])


def changing(run, scene):
    """Change the run itself."""
    run.x.values[:] = 0
    return 1.0


def saved(run, scene):
    """Write to a disk that may be full."""
    if full and scene.noise > 1:
        raise OSError(errno.ENOSPC, "No space left on device", "disk/file")
    return 1.0


def broken(run, scene):
    return 1 / (scene.noise - 3)


def three(run, scene):
    return [1.0, 2.0, 3.0]
