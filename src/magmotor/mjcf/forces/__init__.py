"""Forces on the bodies of a model, which the callback in `mjcf/magnetism.py` applies."""
