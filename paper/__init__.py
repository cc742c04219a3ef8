"""The paper's figures, each with a check of its claims, and its wrong formulas.

This package uses the library `magmotor`, which is installed without it.
"""
