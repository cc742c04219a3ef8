"""The fluctuation-driven motor: a ball and two rings."""
