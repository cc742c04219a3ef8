"""The ensemble kernel's algorithm in C, built if a compiler is available."""

import ctypes
import platform
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.disk.variational import StepCoefficients

SOURCE = Path(__file__).with_name("disk.c")
FLAGS = ["-O3", "-march=native", "-ffast-math", "-fopenmp-simd"]
if platform.machine() in ("x86_64", "AMD64"):
    FLAGS += ["-mprefer-vector-width=512"]  # by default gcc uses half of this on many processors
GROUP = 128
"""Replicas per group in disk.c; the number of replicas is a multiple of this."""


class NotBuilt(Exception):
    """No compiler is available, or it failed; the message says which."""


class CDisk:
    """The disk in C; `defines` may contain XOSHIRO, for another generator, and LIBM."""

    def __init__(self, *defines: str):
        compiler = shutil.which("gcc") or shutil.which("cc")
        if compiler is None:
            raise NotBuilt("no C compiler")
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder) / "disk.so"
            command = [compiler, *FLAGS, *[f"-D{name}" for name in defines], "-fPIC", "-shared"]
            command += ["-o", str(library), str(SOURCE), "-lm"]
            built = subprocess.run(command, capture_output=True, text=True, check=False)
            if built.returncode:
                raise NotBuilt(f"{compiler} failed: {built.stderr.strip().splitlines()[-1]}")
            self._advance = ctypes.CDLL(str(library)).advance
        pointer, integer = ctypes.c_void_p, ctypes.c_int64
        self._advance.argtypes = [pointer, integer, integer, integer, pointer]
        self._advance.restype = None

    def advance(
        self, states: NDArray[np.float64], steps: int, seed: int, coefficients: StepCoefficients
    ) -> None:
        """Advance the states, in the kernel's layout (4, R), by `steps` from step 0 on."""
        o_part, kick, drift = coefficients.parts
        numbers = [*o_part.friction, *o_part.noise[0], kick.push[0] * coefficients.force[0][0]]
        numbers += [drift.turns, drift.angle]
        array = np.array(numbers)
        if states.shape[1] % GROUP or not states.flags.c_contiguous:
            raise ValueError(f"states of shape {states.shape}: not contiguous multiples of {GROUP}")
        self._advance(states.ctypes.data, states.shape[1], steps, seed, array.ctypes.data)
