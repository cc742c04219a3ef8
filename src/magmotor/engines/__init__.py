"""Engines: each runs a scene with the schemes it has, and knows nothing of the others."""
