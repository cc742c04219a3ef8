"""Making the records that are missing, with a progress bar."""

from collections.abc import Sequence

from case import Case, Record
from store import Store
from tqdm import tqdm

BAR = "{l_bar}{bar}| {elapsed}<{remaining} {postfix}"


def measure(cases: Sequence[Case], store: Store) -> dict[str, Record]:
    """Return the records of all cases by key, after making and keeping those that are missing.

    Raises
    ------
    ValueError
        Two cases have the same key.
    """
    records = {case.key: store.find(case) for case in cases}
    if len(records) < len(cases):
        raise ValueError("two cases have the same key")
    missing = [case for case in cases if records[case.key] is None]
    total = sum(case.seconds for case in missing)
    title = f"{len(missing)} of {len(cases)} cases"
    with tqdm(total=total, bar_format=BAR, desc=title, disable=None) as progress:
        for case in missing:
            progress.set_postfix_str(case.key)
            try:
                records[case.key] = record = case.run()
            except Exception as error:
                error.add_note(f"in the case {case.key}")
                raise
            store.keep(case, record)
            progress.update(case.seconds)
    return {key: record for key, record in records.items() if record is not None}
