"""Hamel's top: a magnetic ball under a tilted ring."""
