"""Figures of the sliding disk."""
