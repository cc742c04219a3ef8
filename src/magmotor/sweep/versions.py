"""The versions that a run's bits depend on."""

from functools import cache
from importlib.metadata import version

from magmotor.code_version import machine_versions, package_checksum

NEEDED = {
    "mujoco": ("mujoco", "numba", "numpy"),
    "variational": ("numba", "numpy"),
    "scipy": ("numba", "numpy", "scipy"),
}
"""Beside magmotor itself, by engine."""


@cache
def versions_that_matter(method: str) -> dict[str, str]:
    """Versions of what a method computes with, and the kind of machine.

    Of magmotor there is also a checksum of its code.
    """
    own = f"{version('magmotor')}+{package_checksum():08x}"
    engine = method.partition("/")[0]
    return {"magmotor": own} | {name: version(name) for name in NEEDED[engine]} | machine_versions()
