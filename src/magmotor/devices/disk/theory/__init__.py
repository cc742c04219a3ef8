"""Closed forms and reduced equations of the sliding disk."""
