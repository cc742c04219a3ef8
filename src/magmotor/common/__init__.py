"""Shared utilities: argument checks, files, the environment, and the style of figures."""
