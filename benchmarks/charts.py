"""Measures what the charts show, draws them, and puts them into the documents.

What is measured is kept in out/charts/records.jsonl, case by case: after Ctrl-C the same command
goes on. In the same folder: the pictures, and all tables as tables.md.
"""

import logging
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # where the folder benchmarks is

import magmotor as mm  # chooses who draws, as it can until a topic imports MuJoCo
from benchmarks.harness.command_line import Parser
from benchmarks.harness.publish import publish
from benchmarks.harness.records import Store, measure

TOPICS = {name: f"benchmarks.{name}.topic" for name in ("accuracy", "stability", "detail", "peers")}
"""Modules that have cases of measurements, and make tables and pictures of their records."""

ROOT = Path(__file__).parents[1]
MISTAKE, INTERRUPTED = 2, 130
"""Exit codes."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program; returns its exit code."""
    parser = Parser(prog="charts.py", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer points, in out/charts-quick/")
    parser.add_argument("--only", nargs="+", choices=TOPICS, help="topics; publishes nothing")
    options = parser.parse_args(arguments)
    began = time.perf_counter()
    folder = ROOT / "out" / ("charts-quick" if options.quick else "charts")
    topics = {name: import_module(TOPICS[name]) for name in options.only or TOPICS}
    cases = [case for topic in topics.values() for case in topic.cases(options.quick)]
    store = Store(folder / "records.jsonl")
    logging.getLogger("absl").setLevel(logging.ERROR)  # steps that fail are a part of the charts
    try:
        records = measure(cases, store)
    except KeyboardInterrupt:
        done = sum(store.find(case) is not None for case in cases)
        print(f"stopped: {done} of {len(cases)} records are kept; the same command goes on")
        return INTERRUPTED
    folder.mkdir(parents=True, exist_ok=True)
    tables: dict[str, str] = {}
    for topic in topics.values():
        topic.draw(records, folder)
        tables |= topic.tables(records)
    text = "\n\n".join(f"## {name}\n\n{table}" for name, table in tables.items())
    (folder / "tables.md").write_text(text + "\n", encoding="utf-8")
    written = [*sorted(folder.glob("*.png")), folder / "tables.md"]
    if not (options.quick or options.only):
        try:
            written += publish(tables, topics["accuracy"].front(records), folder, ROOT)
        except (ValueError, OSError) as error:
            print(f"charts.py: all is measured and drawn, not published: {error}", file=sys.stderr)
            return MISTAKE
    print(*(path.relative_to(ROOT) for path in written), sep="\n")
    print(f"{time.perf_counter() - began:.0f} s in all, of magmotor {mm.__version__}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
