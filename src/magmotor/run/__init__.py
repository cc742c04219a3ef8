"""Runs of any device: `simulate`, `ensemble`, `recommend`, and the datasets they return."""
