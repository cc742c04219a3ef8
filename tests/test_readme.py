"""What the README shows works as it stands there."""

import re
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_python_examples_run():
    simulate, magnetise = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    namespace: dict = {}
    exec(simulate, namespace)
    assert np.abs(namespace["run"].momentum_map).max() == pytest.approx(1.858e-4, rel=1e-3)
    namespace = {}
    exec(magnetise, namespace)
    assert namespace["data"].qpos[0] == pytest.approx(np.pi / 2, abs=1e-6)


def test_commands_and_files_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for verb in re.findall(r"^make (\w+)|`make (\w+)`", README, re.MULTILINE):
        assert re.search(rf"^{''.join(verb)}:", makefile, re.MULTILINE), verb
    for path in re.findall(r"`((?:src|scripts|models|docs)/[\w./]*)", README):
        assert (ROOT / path).exists(), path
    for path in re.findall(r"\]\((docs/[^)]*)\)", README):
        assert (ROOT / path).exists(), path
