"""Tables in C of what the library needs without Python, taken from the state of this process.

Compiled code finds functions and variables through cells. In Python, each is bound when it is
needed. In C, they have initial values: the same functions, and variables with the same contents.
The C part looks up MuJoCo's functions and variables when a program loads the library.
"""

import ctypes
import json
import re
from collections.abc import Iterable
from typing import Any

from library import layouts
from magmotor.mjcf import callbacks, layout, memory
from magmotor.mjcf.error_numbers import FORM, KIND
from magmotor.mjcf.error_sentences import ERRORS, LONGEST
from magmotor.mjcf.forces import responses
from magmotor.mjcf.notice_sentences import ASSUMED, ELSE, MARK_NAME, NOT_A_MARK, NOTICES
from magmotor.numerics import symbols
from magmotor_plugin import slots

FUNCTION = "magmotor_function_"
"""Beginning of the symbols of compiled functions, which end with their numbers."""

_OF_MUJOCO = re.compile("_?mj")
_SCALARS = "nattribute", "capabilityflags", "needstage"


def words_of(memory: Any) -> list[int]:
    """Return the words of a ctypes object."""
    content = bytes(memory)
    return [*(ctypes.c_int64 * (len(content) // 8)).from_buffer_copy(content)]


def cells(names: Iterable[str], numbers: dict[int, int]) -> str:
    """Return the cells with their initial values; `numbers` are those of functions by address."""
    lines = []
    for name in names:
        number = numbers.get(symbols.ADDRESSES[name])
        value = f"&{name}" if name in memory.VARIABLES else name
        if number is not None:
            value = f"{FUNCTION}{number}"
        kind = "CELL"
        if _OF_MUJOCO.match(name):
            kind, value = "MUJOCO", name
        lines.append(f"{kind}({name}, {value})\n")
    return "".join(lines)


def variables(names: Iterable[str], numbers: dict[int, int], initial: dict[str, list[int]]) -> str:
    """Return the variables of some cells; `initial` are the words that they or their storage had.

    A variable is a number, the address of a function, or that of words or of another variable.
    """
    ours = [name for name in names if name in memory.VARIABLES and not _OF_MUJOCO.match(name)]
    at = {ctypes.addressof(memory.VARIABLES[name]): name for name in ours}
    plain, pointing = [], []
    for name in ours:
        storage, value = memory.STORAGES.get(name), memory.VARIABLES[name].value
        if storage is None:
            function = numbers.get(value)
            given = initial[name][0] if function is None else f"(int64_t){FUNCTION}{function}"
            plain.append(f"static int64_t {name} = {given};\n")
            continue
        pointed = at.get(ctypes.addressof(storage))
        if pointed is None:
            pointed, words = f"at_{name}", initial[name]
            contents = ", ".join(map(str, words)) if any(words) else "0"
            plain.append(f"static int64_t {pointed}[{len(words)}] = {{{contents}}};\n")
        pointing.append(f"static int64_t {name} = (int64_t)&{pointed};\n")
    return "".join(plain + pointing)


def plugins(numbers: dict[int, int]) -> str:
    """Return the plugins as Python registers them, and the control callback."""
    rows, attributes = [], []
    for name in slots.NAMES:
        plugin, functions = slots.described(name), callbacks.compiled_plugin(name)
        keys = [plugin.attributes[k].decode() for k in range(plugin.nattribute)]
        members = {each: getattr(plugin, each) for each in _SCALARS}
        members |= {each: f"(void *){each}_of_plugin" for each in slots.STUBS[name]}
        members |= {each: f"{FUNCTION}{numbers[of.address]}" for each, of in functions.items()}
        if keys:
            given = ", ".join(map(json.dumps, keys))
            attributes.append(f"static const char *const keys_{len(rows)}[] = {{{given}}};\n")
            members["attributes"] = f"keys_{len(rows)}"
        given = ", ".join(f".{member} = {value}" for member, value in members.items())
        rows.append(f'  {{.name = "{name.decode()}", {given}}},\n')
    callback = numbers[callbacks.compiled_callback().address]
    lines = [*attributes, "static const Plugin plugins[] = {\n", *rows, "};\n"]
    return "".join([*lines, f"#define CALLBACK {FUNCTION}{callback}\n"])


def numbers() -> str:
    """Return the numbers in a header of C, of the layout and of what forms sentences."""
    named = {
        "OFFSETS": len(layout.Layout._fields), "ELSE": ELSE, "ASSUMED": ASSUMED,
        "NOT_A_MARK": NOT_A_MARK, "FORM": FORM, "KIND": KIND, "LONGEST": LONGEST,
        "RESPONSE_BITS": responses.BITS, "RESPONSE_START": responses.START,
        "RESPONSE_MATERIAL": responses.MATERIAL, "RESPONSE_PER_GEOM": responses.PER_GEOM,
    }  # fmt: skip
    texts = {"MARK_NAME": MARK_NAME, "RESPONSES_MARK": responses.MARK.decode()}
    lines = [f"#define {name} {number}\n" for name, number in named.items()]
    return "".join(
        [*lines, *(f"#define {name} {json.dumps(text)}\n" for name, text in texts.items())]
    )


def sentences() -> str:
    """Return the sentences of errors and notices by their numbers and forms."""
    return "".join(
        f"{table}({number}, {form}, {json.dumps(sentence)})\n"
        for table, rows in (("ERROR", ERRORS), ("NOTICE", NOTICES))
        for number, forms in rows.items()
        for form, sentence in forms.items()
    )


def versions() -> str:
    """Return the layouts of the known versions of MuJoCo, and of the one that is installed."""
    import mujoco

    rows = layouts.known() | {mujoco.mj_versionString(): layouts.running()}
    return "".join(
        f'VERSION({row.number}, "{name}", {", ".join(map(str, row.offsets))})\n'
        for name, row in sorted(rows.items(), key=lambda each: each[1].number)
    )
