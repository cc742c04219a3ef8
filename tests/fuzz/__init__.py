"""Hostile input for every public function, class and method; `make fuzz`.

The rule for each input: a ValueError of one sentence that names an argument, an error that the
docstring has under Raises, or a finite result. An input is the source of a call, drawn by
hypothesis from signatures, type hints and the metadata of scenes' fields; its number and the seed
say which. It runs in a process of its own, so that one that crashes or hangs is found, too.
"""
