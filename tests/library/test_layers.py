"""Imports that the import contracts cannot see: lazy names of the package, and names as text."""

import ast
from pathlib import Path

import magmotor as mm

SOURCES = Path(mm.__file__).parent


def imports(tree):
    """Yield each imported name with its module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            yield from ((node.module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)


def hidden(source):
    """Return the imports of a source that would reach any layer without being counted."""
    tree = ast.parse(source)
    found = []
    for module, name in imports(tree):
        folder = SOURCES / name
        is_module = folder.is_dir() or folder.with_suffix(".py").is_file()
        if module == "magmotor" and not (name and is_module):
            found.append(f"{module} {name}")
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            name = node.args[0]
            ours = isinstance(name, ast.Constant) and str(name.value).startswith("magmotor")
            found += [ast.unparse(node)] if ours else []
    return found


def test_no_source_imports_a_lazy_name_or_a_module_by_text():
    """Except the commands: they are programs in the top layer, which may use all of it."""
    below = {*SOURCES.rglob("*.py")} - {*(SOURCES / "commands").glob("*.py")}
    found = {path.name: hidden(path.read_text()) for path in below}
    assert not {name for name, imported in found.items() if imported}


def test_such_imports_are_found():
    wrong = (
        "from magmotor import Disk",
        "import magmotor as mm",
        "def f():\n    from magmotor import simulate",
        "importlib.import_module('magmotor.devices.disk.scene')",
    )
    for source in wrong:
        assert hidden(source), source
    for source in (
        "from magmotor import dipoles",
        "import magmotor.devices",
        "import_module(name)",
    ):
        assert not hidden(source), source
