"""What is measured for the charts: one case is one record."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Record = dict[str, Any]
"""Plain numbers, strings and lists; `failed` says why there is no result."""


@dataclass(frozen=True)
class Case:
    """A measurement: its key among all, what makes the record, and about how long that takes."""

    key: str
    run: Callable[[], Record]
    seconds: float = 1.0
