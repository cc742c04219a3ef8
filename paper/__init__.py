"""Figures: the paper's, each with a check of what it claims, and the prototype's questions."""
