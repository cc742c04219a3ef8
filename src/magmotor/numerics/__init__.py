"""Numerical methods that are independent of models, scenes and files."""
