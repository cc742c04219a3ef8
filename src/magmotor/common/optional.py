"""Packages that only an extra of magmotor installs, and what to say if one is missing."""

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, requires, version

from magmotor.common.exceptions import MagmotorError

LABMAZE = "pip install --no-deps dm-control (its labmaze has no wheel for Python 3.13 or newer)"


class MissingExtra(MagmotorError, ModuleNotFoundError):
    """A package is missing that an extra of magmotor installs; the message says which."""


@contextmanager
def extra(name: str) -> Iterator[None]:
    """Import what an extra installs.

    >>> from magmotor.common.optional import extra
    >>> with extra("movies"):
    ...     import mediapy

    Raises
    ------
    MissingExtra
        A package is missing.
    """
    try:
        yield
    except MissingExtra:
        raise
    except ModuleNotFoundError as missing:
        found = missing_packages(name) or [str(missing.name)]
        sentence = f"{missing.name} is not installed: {remedy(name, found)}"
        raise MissingExtra(sentence, name=missing.name) from missing


def require(*names: str) -> None:
    """Raise MissingExtra if a package of some extras is missing."""
    lacking = {name: missing for name in names if (missing := missing_packages(name))}
    missing = [*dict.fromkeys(package for found in lacking.values() for package in found)]
    if missing:
        sentence = f"{', '.join(missing)} {'is' if len(missing) == 1 else 'are'} not installed"
        raise MissingExtra(f"{sentence}: {remedy(','.join(lacking), missing)}")


def missing_packages(name: str) -> list[str]:
    """Return the packages of an extra, and of the extras within it, that are not installed."""
    return [package for package in packages(name) if not _is_installed(package)]


def packages(name: str) -> list[str]:
    """Return the packages that an extra installs, as the metadata of magmotor lists them."""
    line = re.compile(rf"""([\w.-]+)(?:\[([\w,]+)])?.*\bextra == ['"]{name}['"]""")
    found: list[str] = []
    for match in filter(None, map(line.match, requires("magmotor") or ())):
        package, within = match.groups()
        inner = [p for e in within.split(",") for p in packages(e)] if within else [package]
        found += [p for p in inner if p not in found]
    return found


def remedy(name: str, missing: list[str]) -> str:
    """Return the commands that install what is missing of an extra."""
    whole = f'pip install "magmotor[{name}]"'
    if "dm-control" not in missing or sys.version_info < (3, 13):
        return whole
    return LABMAZE if len(missing) == 1 else f"{whole}, then {LABMAZE}"


def _is_installed(package: str) -> bool:
    try:
        version(package)
    except PackageNotFoundError:
        return False
    return True
