"""Ensembles: many replicas with on-line statistics, so that no trajectory is stored."""

from magmotor.ensemble.gibbs import gibbs
from magmotor.ensemble.run import ensemble

__all__ = ["ensemble", "gibbs"]
