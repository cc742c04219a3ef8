"""Runs of any device: simulate, datasets, checkpoints, advice."""
