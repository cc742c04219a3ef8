"""Ensembles: many replicas with on-line statistics, so that no trajectory is stored."""

from magmotor.devices.disk.ensemble.run import ensemble
from magmotor.devices.disk.gibbs import gibbs

__all__ = ["ensemble", "gibbs"]
