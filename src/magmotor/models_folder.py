"""Where the MJCF parts are."""

from pathlib import Path


def models_folder() -> Path:
    """The folder of MJCF parts: inside the installed package, or beside `src` in a checkout."""
    package = Path(__file__).parent
    for folder in (package / "models", package.parents[1] / "models"):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"no folder models in {package} or {package.parents[1]}")
