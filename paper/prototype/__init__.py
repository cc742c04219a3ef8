"""Figures that answer the questions of a builder of the top."""
