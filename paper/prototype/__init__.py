"""Figures that answer what a builder of the top would ask."""
