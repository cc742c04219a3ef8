"""`python -m trials.fuzz`: hostile input to the public interface, and damaged binaries of models.

Its arguments are, for example, `--inputs 100000 --seed 7`, or `--inputs 0 --binaries 5000`.
"""

import argparse
import contextlib
import itertools
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable

from tqdm import tqdm

from trials.fuzz import binaries, calls
from trials.fuzz.calls import Call
from trials.fuzz.judge import Verdict, judge_targets
from trials.fuzz.pool import judged

FINDINGS = {
    "crash": "crashes",
    "hang": "hangs",
    "raw error": "raw errors",
    "non-finite result": "non-finite results",
}


def fuzz(numbers: Iterable[int], seed: int, processes: int = 2, say: Callable = print) -> bool:
    """Try inputs and report the findings; return whether there are none."""
    inputs = (calls.call(seed, number) for number in numbers)
    return report(judged(inputs, judge_targets, processes), say)


def report(verdicts: Iterable[tuple[Call, Verdict]], say: Callable = print) -> bool:
    """Report the findings by callable, error and location; return whether there are none."""
    counts, groups = Counter(), defaultdict(list)
    with contextlib.suppress(KeyboardInterrupt):  # report the inputs tried so far
        for call, verdict in tqdm(verdicts, "fuzz", unit="input", disable=None):
            counts[verdict.kind] += 1
            if verdict.kind in FINDINGS:
                group = call.target, verdict.kind, verdict.error, verdict.place
                groups[group].append((call, verdict))
    for (target, kind, error, place), found in sorted(groups.items()):
        call, verdict = min(found, key=lambda pair: len(str(pair[0])))
        say(f"{target}: {kind}: {error} at {place} ({len(found)} times)")
        say(f"    --seed {call.seed} --only {call.number}: {shortened(str(call), 500)}")
        if verdict.detail:
            say(f"    {shortened(verdict.detail, 300)}")
    summary = ", ".join(f"{counts[kind]} {plural}" for kind, plural in FINDINGS.items())
    say(
        f"{counts.total()} inputs: {summary} ({counts['refused']} refused,"
        f" {counts['documented']} documented errors, {counts['result']} results)"
    )
    return not groups


def shortened(text: str, length: int) -> str:
    """Return a text as one line of limited length."""
    line = " ".join(text.split())
    return line if len(line) <= length else f"{line[: length - 3]}..."


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m trials.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=5000, help="how many (default: 5000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, metavar="NUMBER", help="only this input")
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER", help="first input")
    parser.add_argument("--of", default="", metavar="REGEX", help="only callables that match")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--binaries", type=int, default=500, help="damaged models (default: 500)")
    options = parser.parse_args()
    names = [target.name for target in calls.found()[0]]
    chosen = [index for index, name in enumerate(names) if re.search(options.of, name)]
    if not chosen:
        parser.error(f"--of {options.of}: no callable matches")
    rounds = itertools.count(options.first // len(names))
    fitting = (len(names) * lap + index for lap in rounds for index in chosen)
    numbers = list(itertools.islice((n for n in fitting if n >= options.first), options.inputs))
    if options.only is not None:
        numbers = [options.only]
        print(calls.call(options.seed, options.only))
    sound = not numbers or fuzz(numbers, options.seed, min(options.processes, len(numbers)))
    if options.only is None and not options.of and not options.first:
        damaged = tqdm(binaries.mutations(options.binaries, options.seed), "binaries", disable=None)
        sound &= binaries.try_binaries(damaged)
    sys.exit(0 if sound else 1)


if __name__ == "__main__":
    main()
