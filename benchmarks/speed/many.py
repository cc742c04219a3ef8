"""Many free magnets: each pair once, by two threads, and as clusters."""

from benchmarks.harness.tables import Row, show
from benchmarks.many.magnets import times

NOTE = """\
Forces and torques of free magnets on one another, by a call of the callback; "before" computes each
  pair twice, in a bare loop. Clusters err by less than 1e-3 of the RMS force. Two threads need two
  idle cores."""


def main() -> None:
    rows = []
    for count, at_most in ((1000, 0.85), (4000, 0.85)):
        found = times(count, turns=10)
        rows += [
            Row(f"{count} magnets", [found["forces"]], [found["before"]], at_most),
            Row(f"{count} magnets, 2 threads", [found["forces, 2 threads"]], [found["before"]]),
            Row(f"{count} in a box, 1e-3", [found["forces, box"]], [found["before"]]),
            Row(f"{count} in a sheet, 1e-3", [found["forces, sheet"]], [found["before"]]),
        ]
    show("Many magnets", NOTE, ("time", "before", "ratio"), rows)
