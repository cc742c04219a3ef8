"""Numbers only: what knows no model, no scene and no file."""
