"""Boltzmann's law of a model: samples of it, and temperatures by which one can check a run."""
