"""Pages that the project keeps outside docs/, and what the footer says of the project."""

import tomllib
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[2]


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Give the footer's template the version and the links of pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    config.extra["project"] = project
    return config


def on_files(files: Files, config: MkDocsConfig, **_: Any) -> Files:
    """Add the changelog and the license."""
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").replace("](docs/", "](")
    license_text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    files.append(File.generated(config, "changelog.md", content=changelog))
    files.append(
        File.generated(config, "license.md", content=f"# License\n\n```text\n{license_text}```\n")
    )
    return files
