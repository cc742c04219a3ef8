"""Magnetic response of rigid pieces of iron, by charges on their surfaces."""
