"""`mm.check`: what will fail in a model, before it runs."""
