"""Compile all functions of the library into one module of LLVM; `build.py` runs this.

Numba compiles them when they are called, here as there, except that they look up the numbers of
layouts and the addresses of symbols in memory. What it has optimized is linked and optimized again.
"""

import ctypes
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import types

from library import tables
from library.exercise import beside, everything
from magmotor.mjcf import layout, memory
from magmotor.numerics import dependencies, numba_cache, symbols
from magmotor.numerics.compiler.constants import OFFSETS
from magmotor.numerics.compiler.memory import CELL
from magmotor.numerics.native_library import FORMAT, name_of
from magmotor_plugin.library import library as mujoco_library

OF_C = {
    "memset", "memcpy", "memmove", "sin", "cos", "tan", "sincos", "atan2", "exp", "log", "pow",
    "sqrt", "fma",
}  # fmt: skip
"""Names of functions that the library takes from libc and libm."""

OF_ARRAYS = {
    "NRT_MemInfo_alloc_aligned", "NRT_MemInfo_call_dtor", "numba_attempt_nocopy_reshape",
}  # fmt: skip
OF_NUMBA = re.compile(r"Py|_Py|NRT_|numba_")
"""Names that Numba's code has for Python's errors and for arrays, of which the C part has stubs."""


class Cells:
    """Cells with the addresses of symbols, for the code that runs in this process.

    Attributes
    ----------
    initial : dict
        The words that each variable, or the memory at the address in it, had when it was bound.
    """

    def __init__(self) -> None:
        self._cells: dict[str, ctypes.c_int64] = {}
        self.initial: dict[str, list[int]] = {}

    def bind(self, symbol: str, address: int) -> None:
        """Write an address into the cell of a symbol."""
        if symbol not in self._cells:
            self._cells[symbol] = ctypes.c_int64()
            llvm.add_symbol(CELL + symbol, ctypes.addressof(self._cells[symbol]))
            if symbol in memory.VARIABLES:
                found = memory.STORAGES.get(symbol, memory.VARIABLES[symbol])
                self.initial[symbol] = tables.words_of(found)
        self._cells[symbol].value = address


class Compiled:
    """A function that has been compiled: its name in the library, and the versions of its code."""

    def __init__(self, defined: dependencies.Defined, signature: str, found: Any) -> None:
        self.name = name_of(defined.define, defined.by)
        self.checksum = defined.checksum
        self._found, self._is_c = found, bool(signature)
        self.address = found.address if signature else 0

    def versions(self) -> list[tuple[Any, str, str, str]]:
        """Return the module, the function in it, the arguments and the result of each version."""
        if self._is_c:
            library = self._found._library
            return [(library._get_module_for_linking(), self._found._wrapper_name, "", "")]
        found = []
        for result in self._found.overloads.values():
            kinds = result.signature.args
            if isinstance(result.signature.return_type, types.Array):
                continue  # which would need Numba's memory
            if any(isinstance(kind, types.Literal) for kind in kinds):
                continue  # compiled code called it with a constant, for which alone it is right
            arguments = ",".join(map(kind_of, kinds))
            returned = format_of(result.signature.return_type)
            module = result.library._get_module_for_linking()
            found.append((module, result.fndesc.llvm_func_name, arguments, returned))
        return found


def kind_of(kind: Any) -> str:
    """Return the kind of an argument, as `magmotor.numerics.native_calls` has it."""
    if isinstance(kind, types.Array):
        access = "" if kind.mutable else "r"
        return f"{np.dtype(str(kind.dtype)).char}{kind.ndim}{kind.layout}{access}"
    if isinstance(kind, types.BaseTuple):
        return f"({','.join(map(kind_of, kind.types))})"  # pyright: ignore[reportAttributeAccessIssue]
    if kind == types.none:
        return "NoneType"
    return format_of(kind)


def format_of(kind: Any) -> str:
    """Return the format of a number, or of a tuple of numbers, for `struct`."""
    if isinstance(kind, types.BaseTuple):
        return "".join(map(format_of, kind.types))  # pyright: ignore[reportAttributeAccessIssue]
    letters = {
        types.int64: "q", types.uint64: "Q", types.int32: "i", types.float64: "d",
        types.boolean: "?", types.none: "",
    }  # fmt: skip
    return letters[kind]


def main(folder: Path | None) -> None:
    """Compile everything, and write the module, tables for C, and the description.

    Another process, which gets no folder, compiles a half, which this one then finds on the disk.
    """
    made: list[Compiled] = []
    compiled = numba_cache.compiled

    def record(defined: dependencies.Defined, signature: str, options: dict[str, Any]) -> Any:
        found = compiled(defined, signature, options)
        made.append(Compiled(defined, signature, found))
        return found

    numba_cache.compiled = record
    symbols.INDIRECT = True
    bound = Cells()
    symbols.bind_in(bound)
    offsets = layout.current()
    table = (ctypes.c_int64 * len(offsets))(*offsets)
    llvm.add_symbol(OFFSETS, ctypes.addressof(table))
    if folder is None:
        beside()
        return
    command = [sys.executable, "-m", "library.ahead_of_time"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as helper:
        everything(helper.wait)
    made.sort(key=lambda one: one.name)
    whole, functions = link(made)
    (folder / "functions.ll").write_text(without_exceptions(whole), encoding="utf-8")
    by_address = {one.address: functions[one.name]["versions"][0][0] for one in made if one.address}
    for name, text in c_tables(whole, functions, by_address, bound.initial).items():
        (folder / name).write_text(text, encoding="utf-8")
    description = {
        "format": FORMAT,
        "offsets": offsets._fields,
        "functions": functions,
    }
    (folder / "description.json").write_text(json.dumps(description))


def c_tables(
    whole: Any,
    functions: dict[str, Any],
    by_address: dict[int, int],
    initial: dict[str, list[int]],
) -> dict[str, str]:
    """Return the files that the C part includes, by name."""
    numbers = [version[0] for function in functions.values() for version in function["versions"]]
    found = (symbol.name for symbol in whole.global_variables if symbol.name.startswith(CELL))
    cells = sorted(name.removeprefix(CELL) for name in found)
    never = {
        each.name
        for each in [*whole.functions, *whole.global_variables]
        if each.is_declaration and OF_NUMBA.match(each.name)
    }
    return {
        "functions.inc": "".join(f"FUNCTION({k})\n" for k in numbers),
        "never.inc": "".join(f"NEVER({name})\n" for name in sorted(never - OF_ARRAYS)),
        "cells.inc": tables.cells(cells, by_address),
        "variables.inc": tables.variables(cells, by_address, initial),
        "plugins.inc": tables.plugins(by_address),
        "versions.inc": tables.versions(),
        "sentences.inc": tables.sentences(),
        "numbers.h": tables.numbers(),
    }


def link(made: list[Compiled]) -> tuple[Any, dict[str, Any]]:
    """Return one module with all functions, and what the description says of them."""
    whole, functions, number = llvm.parse_assembly(""), {}, 0
    for function in made:
        entries: list[tuple[int, str, str]] = []
        for source, inner, arguments, result in function.versions():
            module = llvm.parse_bitcode(source.as_bitcode())
            symbol = f"{tables.FUNCTION}{number}"
            for each in [*module.functions, *module.global_variables]:
                if not each.is_declaration:
                    each.linkage = "internal"
            entry = module.get_function(inner)
            entry.linkage = "external"
            if result or arguments:
                kinds = [str(argument.type) for argument in entry.arguments]
                module.link_in(llvm.parse_assembly(by_words(symbol, inner, kinds, arguments)))
                module.get_function(inner).linkage = "internal"
            else:
                entry.name = symbol
            module.get_function(symbol).visibility = "hidden"
            if not whole.data_layout:
                whole.data_layout, whole.triple = module.data_layout, module.triple
            whole.link_in(module)
            entries.append((number, arguments, result))
            number += 1
        if len({arguments for _, arguments, _ in entries}) < len(entries):
            raise ValueError(f"{function.name} has two versions for the same arguments")
        functions[function.name] = {"checksum": function.checksum, "versions": entries}
    whole.link_in(llvm.parse_assembly(calls_by_cells(whole)))
    for each in whole.functions:
        if not each.is_declaration and not each.name.startswith(tables.FUNCTION):
            each.linkage = "internal"
    for variable in whole.global_variables:
        if variable.name.startswith(CELL) or variable.name == OFFSETS:
            variable.visibility = "hidden"
    return whole, functions


def words_of(arguments: str) -> int:
    """Return the number of words that Python passes for arguments of these kinds."""
    kinds = filter(None, re.split(r"[(),]", arguments))
    arrays = (re.fullmatch(r"[a-zA-Z?](\d+)[CFA]r?", kind) for kind in kinds)
    return sum(5 + 2 * int(array[1]) if array else 1 for array in arrays)


def by_words(symbol: str, function: str, kinds: list[str], arguments: str) -> str:
    """Return code of a C function with two arguments: words, and the address of the result."""
    if len(kinds) - 2 != words_of(arguments):
        raise ValueError(f"{function} takes other words than ({arguments})")
    lines = [
        f'declare i32 @"{function}"({", ".join(kinds)})',
        f"define i32 @{symbol}(ptr %words, ptr %result) {{",
        "%exception = alloca ptr",
        "store ptr null, ptr %exception",
    ]
    given = ["ptr %result", "ptr %exception"]
    for k, kind in enumerate(kinds[2:]):
        lines += [f"%p{k} = getelementptr i64, ptr %words, i64 {k}", f"%w{k} = load i64, ptr %p{k}"]
        convert = {"i64": "", "ptr": "inttoptr", "double": "bitcast"}.get(kind, "trunc")
        if convert:
            lines.append(f"%a{k} = {convert} i64 %w{k} to {kind}")
        given.append(f"{kind} %{'a' if convert else 'w'}{k}")
    lines += [f'%status = call i32 @"{function}"({", ".join(given)})', "ret i32 %status", "}"]
    return "\n".join(lines)


def calls_by_cells(module: Any) -> str:
    """Return code that calls each C function of MuJoCo or ours by the address in its cell."""
    lines = []
    for function in module.functions:
        name = function.name
        if not function.is_declaration or name in OF_C or OF_NUMBA.match(name):
            continue
        if name.startswith("llvm."):
            continue
        kinds = [str(argument.type) for argument in function.arguments]
        returned = str(function.global_value_type).partition(" (")[0]
        given = ", ".join(f"{kind} %a{k}" for k, kind in enumerate(kinds))
        result, value = ("", "") if returned == "void" else ("%result = ", " %result")
        lines += [
            f"@{CELL}{name} = external global ptr",
            f"define {returned} @{name}({given}) alwaysinline {{",
            f"%function = load ptr, ptr @{CELL}{name}",
            f"{result}tail call {returned} %function({given})",
            f"ret {returned}{value}",
            "}",
        ]
    return "\n".join(lines)


def without_exceptions(module: Any) -> str:
    """Return a module in LLVM's language, without what Python would raise, which contains paths."""
    kept = r"^(@\.const\.picklebuf\.[\w.]+ = .*constant \{[^}]*\}) \{.*\}"
    return re.sub(kept, r"\1 zeroinitializer", str(module), flags=re.MULTILINE)


if __name__ == "__main__":
    mujoco_library()
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
