"""The targets: all public callables, found by walking the package, including new ones."""

import dataclasses
import importlib
import inspect
import re
import typing
from typing import Any, NamedTuple

import mujoco
from numba.core.registry import CPUDispatcher

MODULES = (
    *("magmotor", "magmotor.theory", "magmotor.observables", "magmotor.plots", "magmotor.render"),
    *(
        "magmotor.sweep",
        "magmotor.noise",
        "magmotor.dipoles",
        "magmotor.device.provenance",
        "magmotor.live",
    ),
)

EXCLUDED = {
    "mm.advise": "measures for as long as its budget says; see test_arguments.py",
    "mm.sweep.local_cluster": "starts a scheduler and workers",
    "mm.sweep.dask_workers": "waits for a scheduler",
    "live.Loop": "called by windows and pages only, with their keys and times",
    "live.WebView": "serves a page",
    "live.web": "serves a page",
    "mm.device.provenance.assemble": "the engines' own, with chunks of their kernels",
    "mm.device.provenance.attributes_of": "the engines' own, with any attributes",
    "mm.device.provenance.numerics_of": "the plots' own, with runs that they have checked",
}


class Parameter(NamedTuple):
    """A parameter as described by signature, docstring and, for scenes' fields, metadata."""

    name: str
    hint: Any
    default: Any
    doc: str
    metadata: Any

    @property
    def required(self) -> bool:
        return self.default is inspect.Parameter.empty


class Target(NamedTuple):
    """A function, constructor, method or property."""

    name: str
    parameters: tuple[Parameter, ...]
    owner: type | None
    """Class of the receiver of a method or property, an instance or itself."""
    kind: str
    doc: str


def targets() -> list[Target]:
    """Return all public callables by name."""
    found: dict[str, Target] = {}
    seen: set[int] = set()
    for module_name in MODULES:
        module = importlib.import_module(module_name)
        prefix = "live" if module_name == "magmotor.live" else module_name.replace("magmotor", "mm")
        for name in _public(module):
            value, full = getattr(module, name), f"{prefix}.{name}"
            if full in EXCLUDED or id(value) in seen:
                continue
            seen.add(id(value))
            if inspect.isclass(value):
                found |= {target.name: target for target in of_class(full, value)}
            elif callable(value) and not isinstance(value, CPUDispatcher):
                found[full] = of_function(full, value)
    data = Parameter("data", mujoco.MjData, None, "", None)
    acted = (found["mm.Langevin"].parameters[0], data)  # on the data stepped inside the block
    found["mm.magnetism"] = found["mm.magnetism"]._replace(parameters=acted)
    return [found[name] for name in sorted(found)]


def of_function(name: str, function: Any, owner: type | None = None, kind: str = "function"):
    """Return the target for a function."""
    doc = "\n".join(filter(None, [inspect.getdoc(function), owner and inspect.getdoc(owner)]))
    return Target(name, tuple(_parameters(function, owner)), owner, kind, doc)


def of_class(name: str, kind: type) -> list[Target]:
    """Constructor, methods and properties of a class of ours.

    The constructor that Python makes for a tuple of results holds what it is given, and an error
    is made where it is raised: neither is called.
    """
    if issubclass(kind, BaseException):
        return []
    found = []
    if checks(kind):
        found.append(of_function(name, kind, None)._replace(doc=_docs(kind)))
    for base in kind.__mro__:
        if not base.__module__.startswith("magmotor"):
            continue
        for attribute, value in vars(base).items():
            if attribute.startswith("_") or any(t.name == f"{name}.{attribute}" for t in found):
                continue
            if isinstance(value, classmethod | staticmethod):
                method = getattr(kind, attribute)
                found.append(of_function(f"{name}.{attribute}", method, kind, "of the class"))
            elif inspect.isfunction(value):
                found.append(of_function(f"{name}.{attribute}", value, kind, "method"))
            elif isinstance(value, property) or type(value).__name__ == "cached_property":
                doc = _docs(kind, value)
                found.append(Target(f"{name}.{attribute}", (), kind, "property", doc))
    return found


def checks(kind: type) -> bool:
    """Whether a constructor is not generated."""
    if issubclass(kind, tuple):
        return False
    return not dataclasses.is_dataclass(kind) or hasattr(kind, "__post_init__")


def _docs(*objects: Any) -> str:
    return "\n".join(inspect.getdoc(o) or "" for o in objects)


def _public(module: Any) -> list[str]:
    if hasattr(module, "__all__"):
        return list(module.__all__)
    own = vars(module).items()
    return [k for k, v in own if k[0] != "_" and getattr(v, "__module__", "") == module.__name__]


def _parameters(function: Any, owner: type | None) -> typing.Iterator[Parameter]:
    plain = inspect.unwrap(function)
    fields = owner or (plain if inspect.isclass(plain) else None)
    metadata = {}
    if fields is not None and dataclasses.is_dataclass(fields):
        metadata = {f.name: f for f in dataclasses.fields(fields) if "unit" in f.metadata}
    hinted = plain
    if inspect.isclass(plain) and not dataclasses.is_dataclass(plain):
        hinted = plain.__init__
    try:
        hints = typing.get_type_hints(hinted)
    except NameError:  # a name that is imported only for type checkers
        hints = {}
    doc = _docs(plain)
    for name, parameter in inspect.signature(plain).parameters.items():
        if name in ("self", "cls"):
            continue
        if parameter.kind is parameter.VAR_KEYWORD:  # **changes of a scene
            own = typing.get_type_hints(owner) if owner else {}
            for field in dataclasses.fields(fields) if dataclasses.is_dataclass(fields) else ():
                described, bounds = own.get(field.name, Any), metadata.get(field.name)
                yield Parameter(field.name, described, field.default, "", bounds)
            continue
        hint = hints.get(name, Any)
        line = _line(doc, name)
        field = metadata.get(name) if inspect.isclass(plain) else None
        yield Parameter(name, hint, parameter.default, line, field)


def _line(doc: str, name: str) -> str:
    """Return a parameter's type and shape from the docstring."""
    for line in doc.splitlines():
        names, colon, description = line.strip().partition(" : ")
        if colon and name in re.split(r",\s*", names):
            return description
    return ""
