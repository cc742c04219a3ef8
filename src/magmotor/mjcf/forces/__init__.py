"""What acts on the bodies of a model; the callback in `mjcf/magnetism.py` calls each source."""
