"""The paper's wing: its figures, each with a check of what it claims, and its wrong formulas.

It uses the library `magmotor`, which knows nothing of it and is installed without it.
"""
