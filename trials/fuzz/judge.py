"""The rule: a named ValueError, a documented error, or a finite result."""

import ast
import contextlib
import dataclasses
import re
import shutil
import traceback
import types
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
import xarray as xr

import magmotor as mm

from . import material
from .calls import Call, found
from .targets import Target

HOME = str(Path(mm.__file__).parent)


class Verdict(NamedTuple):
    """The outcome of an input."""

    kind: str
    """refused, documented or result; raw error, non-finite result, crash or hang."""
    error: str = ""
    place: str = ""
    detail: str = ""


def judge_targets() -> Callable[[Call], Verdict]:
    """Return the function by which a worker judges calls."""
    every = {target.name: target for target in found()[0]}
    complete = {name: _with_references(target, every) for name, target in every.items()}
    return lambda call: judge(call, complete[call.target])


def _with_references(target: Target, every: dict[str, Target]) -> Target:
    """Append the docstrings that a target's own refers to, which may list errors and NaN."""
    named = set(re.findall(r"`(?:\w+\.)*(\w+)`", target.doc))
    others = [other.doc for name, other in every.items() if name.rsplit(".", 1)[-1] in named]
    return target._replace(doc="\n".join([target.doc, *others]))


def judge(call: Call, target: Target) -> Verdict:
    """Make a call and judge its outcome."""
    material._models.clear()
    # Figures and models that a call leaves open must not affect the next one.
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", module="glfw")
        try:
            what, where = _not_finite(_called(call, target), target.doc)
            verdict = Verdict("result", what, detail=where)
            if verdict.error:
                verdict = verdict._replace(kind="non-finite result")
        except MemoryError as error:
            verdict = _raw(error)
        except BaseException as error:
            verdict = _judged(error, target)
    for file in Path().iterdir():
        with contextlib.suppress(OSError):
            shutil.rmtree(file) if file.is_dir() and not file.is_symlink() else file.unlink()
    bad = [w for w in warned if not _expected(w, target)]
    if bad and verdict.kind in ("result", "refused", "documented"):
        first = bad[0]
        place = f"{_short(first.filename)}:{first.lineno}"
        return Verdict("raw error", first.category.__name__, place, str(first.message))
    return verdict


def _called(call: Call, target: Target) -> Any:
    last = call.target.rsplit(".", 1)[-1]
    names = material.NAMESPACE
    if target.kind in ("method", "property", "of the class"):
        receiver = eval(call.receiver or "", dict(names))
        if target.kind == "property":
            return getattr(receiver, last)
        function = getattr(receiver, last)
    else:
        acting = {"mm.magnetism": "stepped"}
        function = eval(acting.get(call.target, call.target), dict(names))
    given = {name: eval(text, dict(names)) for name, text in call.arguments or ()}
    damaged = [name for name, value in given.items() if isinstance(value, material.Damaged)]
    for name in damaged:
        how, given[name] = given[name], Path("damaged.npz")
        with contextlib.suppress(Exception):
            function(**given)
        if given[name].exists():
            how.made(given[name])
    result = function(**given)
    return list(result) if isinstance(result, types.GeneratorType) else result


def _judged(error: BaseException, target: Target) -> Verdict:
    name = type(error).__name__
    if isinstance(error, ValueError) and _ours(error):
        words = str(error)
        if not _is_sentence(words):
            return _raw(error, f"{name} without a sentence")
        return Verdict("refused", name, _place(error), words)
    listed = _raises(target)
    if any(base.__name__ in listed for base in type(error).__mro__) and _ours(error, name):
        return Verdict("documented", name, _place(error), str(error))
    return _raw(error)


@cache
def _names() -> set[str]:
    """Return the names of all parameters."""
    return {parameter.name for target in found()[0] for parameter in target.parameters}


def _is_sentence(words: str) -> bool:
    """Whether a message is one line that names an argument."""
    named = " = " in words or not _names().isdisjoint(re.findall(r"\w+", words))
    return bool(words) and "\n" not in words and named


def _ours(error: BaseException, name: str = "") -> bool:
    """Whether a `raise` in the package, MuJoCo or the system deliberately raised an error."""
    if isinstance(error, mujoco.FatalError | OSError | FloatingPointError):
        return True
    frames = traceback.extract_tb(error.__traceback__)
    last = frames[-1]
    return last.filename.startswith(HOME) and (last.lineno or 0) in _raising(last.filename)


@cache
def _raising(filename: str) -> set[int]:
    """Return the lines of `raise` statements."""
    tree = ast.parse(Path(filename).read_text())
    lines = [(n.lineno, n.end_lineno or n.lineno) for n in ast.walk(tree) if type(n) is ast.Raise]
    return {line for first, last in lines for line in range(first, last + 1)}


def _raises(target: Target) -> set[str]:
    """Return the names of errors that are documented, or implied by the parameters."""
    listed = set(re.findall(r"^\s*((?:\w+\.)*[A-Z]\w+)$", target.doc, re.MULTILINE))
    names = {name.rsplit(".", 1)[-1] for name in listed} | {"SimulationDiverged", "PhysicalEvent"}
    if any("Path" in str(p.hint) or p.name in ("path", "directory") for p in target.parameters):
        names.add("OSError")
    if "magnetism" in target.doc or "FatalError" in target.doc or "MjModel" in str(target):
        names.add("FatalError")
    return names


def _expected(warned: warnings.WarningMessage, target: Target) -> bool:
    """Whether a warning is documented, or concerns only unclosed files or deprecations."""
    name = warned.category.__name__
    if name in ("ResourceWarning", "DeprecationWarning", "PendingDeprecationWarning"):
        return True
    return name == "UserWarning" and "Warns" in target.doc


def _raw(error: BaseException, name: str = "") -> Verdict:
    return Verdict("raw error", name or type(error).__name__, _place(error), str(error))


def _place(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if frame.filename.startswith(HOME)]
    frame = (ours or frames)[-1]
    return f"{_short(frame.filename)}:{frame.lineno}"


def _short(filename: str) -> str:
    return filename.removeprefix(HOME + "/")


def _not_finite(result: Any, doc: str, name: str = "result", depth: int = 0) -> tuple[str, str]:
    """Return what is neither finite nor documented in a result, and where it is."""
    if isinstance(result, bool | str | bytes | int | None | type):
        return "", ""
    if isinstance(result, xr.Dataset):
        parts = {**result.variables, **result.attrs}
        return _first(parts, doc, name, depth)
    if isinstance(result, mujoco.MjData):
        return _first({"qpos": result.qpos, "qvel": result.qvel}, doc, name, depth)
    if isinstance(result, dict):
        return _first(result, doc, name, depth)
    if isinstance(result, list | tuple):
        names = getattr(result, "_fields", range(len(result)))
        return _first(dict(zip(names, result, strict=True)), doc, name, depth)
    if dataclasses.is_dataclass(result):
        fields = {f.name: getattr(result, f.name) for f in dataclasses.fields(result)}
        return _first(fields, doc, name, depth)
    if isinstance(result, xr.Variable | xr.DataArray):
        result = result.values
    if isinstance(result, float | complex | np.generic | np.ndarray):
        array = np.asarray(result)
        if array.dtype.kind not in "fc":
            return "", ""
        if np.isnan(array).any() and not re.search(r"\bNaN\b", doc):
            return "NaN", name
        if np.isinf(array).any() and not re.search(r"\binf(inite|inity|)\b", doc):
            return "infinity", name
    return "", ""


def _first(parts: dict[Any, Any], doc: str, name: str, depth: int) -> tuple[str, str]:
    if depth < 4:
        for key, part in parts.items():
            what, where = _not_finite(part, doc, f"{name}[{key!r}]", depth + 1)
            if what:
                return what, where
    return "", ""
