"""Figures of Hamel's top."""
