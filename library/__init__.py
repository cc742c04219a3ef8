"""The library for programs without a compiler: what builds it, and its C part."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "src"))  # a build of wheels installs nothing
