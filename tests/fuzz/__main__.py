"""`make fuzz`: hostile input to all that is public; ARGS="--inputs 100000 --seed 7"."""

import argparse
import contextlib
import itertools
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable

from tqdm import tqdm

from . import calls
from .calls import Call
from .judge import Verdict, judge_targets
from .pool import judged

FINDINGS = {
    "crash": "crashes",
    "hang": "hangs",
    "raw error": "raw errors",
    "non-finite result": "non-finite results",
}


def fuzz(numbers: Iterable[int], seed: int, processes: int = 2, say: Callable = print) -> bool:
    """Try inputs, tell what was found; whether that is nothing."""
    inputs = (calls.call(seed, number) for number in numbers)
    return report(judged(inputs, judge_targets, processes), say)


def report(verdicts: Iterable[tuple[Call, Verdict]], say: Callable = print) -> bool:
    """Tell what was found, by callable, error and place."""
    counts, groups = Counter(), defaultdict(list)
    with contextlib.suppress(KeyboardInterrupt):  # then it tells of those that were tried
        for call, verdict in tqdm(verdicts, "fuzz", unit="input", disable=None):
            counts[verdict.kind] += 1
            if verdict.kind in FINDINGS:
                group = call.target, verdict.kind, verdict.error, verdict.place
                groups[group].append((call, verdict))
    for (target, kind, error, place), found in sorted(groups.items()):
        call, verdict = min(found, key=lambda pair: len(str(pair[0])))
        say(f"{target}: {kind}: {error} at {place} ({len(found)} times)")
        say(f"    --seed {call.seed} --only {call.number}: {shortened(str(call), 500)}")
        if verdict.told:
            say(f"    {shortened(verdict.told, 300)}")
    told = ", ".join(f"{counts[kind]} {plural}" for kind, plural in FINDINGS.items())
    say(
        f"{counts.total()} inputs: {told} ({counts['refused']} refused,"
        f" {counts['documented']} documented errors, {counts['result']} results)"
    )
    return not groups


def shortened(text: str, length: int) -> str:
    """Text in one line that is not too long."""
    line = " ".join(text.split())
    return line if len(line) <= length else f"{line[: length - 3]}..."


def main() -> None:
    parser = argparse.ArgumentParser(prog="make fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=5000, help="how many (default: 5000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, metavar="NUMBER", help="this input alone")
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER", help="begin with it")
    parser.add_argument("--of", default="", metavar="REGEX", help="only callables of such names")
    parser.add_argument("--processes", type=int, default=2)
    told = parser.parse_args()
    names = [target.name for target in calls.found()[0]]
    places = [place for place, name in enumerate(names) if re.search(told.of, name)]
    if not places:
        parser.error(f"--of {told.of}: no callable has such a name")
    rounds = itertools.count(told.first // len(names))
    fitting = (len(names) * lap + place for lap in rounds for place in places)
    numbers = list(itertools.islice((n for n in fitting if n >= told.first), told.inputs))
    if told.only is not None:
        numbers = [told.only]
        print(calls.call(told.seed, told.only))
    sys.exit(0 if fuzz(numbers, told.seed, min(told.processes, len(numbers))) else 1)


if __name__ == "__main__":
    main()
