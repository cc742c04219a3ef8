"""What a model declares: read once, into a table of integers that all forces and reports read."""
