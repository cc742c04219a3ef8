"""Measures the data of the charts, draws them, and updates the documents.

Measurements are kept in out/charts/records.jsonl, case by case: after Ctrl-C the same command
resumes. The same folder contains the pictures, and all tables in tables.md.
"""

import logging
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the folder benchmarks

import magmotor as mm  # selects an OpenGL library, before a topic imports MuJoCo
from benchmarks.harness.command_line import Parser
from benchmarks.harness.publish import publish
from benchmarks.harness.records import Store, measure, not_installed

TOPICS = {
    name: f"benchmarks.{name}.topic"
    for name in ("accuracy", "stability", "detail", "peers", "many", "advice")
}
"""Modules with cases to measure, and tables and pictures of their records."""

ROOT = Path(__file__).parents[1]
ERROR, INTERRUPTED = 2, 130
"""Exit codes."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    parser = Parser(prog="charts.py", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer points, in out/charts-quick/")
    parser.add_argument("--only", nargs="+", choices=TOPICS, help="topics; publishes nothing")
    options = parser.parse_args(arguments)
    began = time.perf_counter()
    folder = ROOT / "out" / ("charts-quick" if options.quick else "charts")
    topics = {name: import_module(TOPICS[name]) for name in options.only or TOPICS}
    cases = [case for topic in topics.values() for case in topic.cases(options.quick)]
    store = Store(folder / "records.jsonl")
    logging.getLogger("absl").setLevel(logging.ERROR)  # failing steps are a part of the charts
    try:
        records = measure(cases, store)
    except KeyboardInterrupt:
        done = sum(store.find(case) is not None for case in cases)
        print(f"stopped: {done} of {len(cases)} records are kept; the same command resumes")
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
        missing = {not_installed(record) for record in records.values()} - {""}
        if missing:
            names = "; ".join(sorted(missing))
            print(f"charts.py: not published, since not installed: {names}", file=sys.stderr)
            return ERROR
        try:
            written += publish(tables, topics["accuracy"].front(records), folder, ROOT)
        except (ValueError, OSError) as error:
            print(f"charts.py: measured and drawn, but not published: {error}", file=sys.stderr)
            return ERROR
    print(*(path.relative_to(ROOT) for path in written), sep="\n")
    print(f"{time.perf_counter() - began:.0f} s in all, of magmotor {mm.__version__}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
