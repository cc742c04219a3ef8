"""Figures of the fluctuation-driven motor."""
