"""Ensembles of disk and particle: many replicas with on-line statistics, no trajectory stored."""
