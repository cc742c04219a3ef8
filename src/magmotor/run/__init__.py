"""Runs of any device: `simulate`, `ensemble`, `recommend`, and the datasets they return."""

import magmotor.devices  # noqa: F401  (registers the scenes that arguments and datasets may be of)
