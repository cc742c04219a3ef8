"""Hostile input for every public function, class and method; `python -m trials.fuzz`.

Each input must lead to a ValueError of one sentence that names an argument, an error that the
docstring lists under Raises, or a finite result. An input is the source text of a call, which
hypothesis draws from signatures, type hints and the metadata of scenes' fields; its number and the
seed determine it. Calls run in worker processes, so that crashes and hangs are found as well.
"""
