"""The packages of the corpus: requirements.txt, downloaded once into .cache/corpus (1.1 GB)."""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / ".cache" / "corpus"
REQUIREMENTS = Path(__file__).with_name("requirements.txt")


def add_folder(parser: argparse.ArgumentParser) -> None:
    """Add the argument of all programs of the corpus."""
    parser.add_argument(
        "folder", type=Path, nargs="?", help="of any MJCF; by default that of the packages"
    )


def folder_of(options: argparse.Namespace) -> Path:
    """Return the given folder, or that of the packages, which are downloaded if need be."""
    if options.folder is not None:
        return options.folder.absolute()
    ready = FOLDER / "ready"
    if not ready.exists() or ready.stat().st_mtime < REQUIREMENTS.stat().st_mtime:
        print("downloading the packages of the corpus (once: 1.1 GB and about a minute)")
        shutil.rmtree(FOLDER, ignore_errors=True)
        # Only files of the packages are read, so conflicts among them do not matter.
        install = [sys.executable, "-m", "pip", "install", "-qq", "--no-deps", "--no-compile"]
        install += ["--only-binary=:all:", "--ignore-requires-python", "--no-warn-conflicts"]
        subprocess.run([*install, "--target", FOLDER, "-r", REQUIREMENTS], check=True)
        ready.touch()
    return FOLDER
