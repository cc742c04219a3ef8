"""Programs that try the package for minutes or hours: run by hand, and in small doses by tests."""
