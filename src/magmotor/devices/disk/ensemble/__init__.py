"""Ensembles of disk and particle: many replicas, with on-line statistics instead of records."""
