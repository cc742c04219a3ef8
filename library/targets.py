"""The kinds of processors for which there are libraries, and machine code for them.

Numba optimizes the functions for a processor of the machine that builds the library. Machine code
for other machines is made of the same optimized functions, so that their results are the same.
"""

import os
import platform
import re
import shlex
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import llvmlite.binding as llvm

from magmotor.numerics.native_library import LEVELS


class Target(NamedTuple):
    """A kind of processor, with its system.

    Attributes
    ----------
    machine : str
        As `platform.machine` names it there.
    triple, processor : str
        LLVM's names.
    file : str
        Name of the library.
    level : int
        Level of an x86-64 processor.
    flags : tuple of str
        Options of the C compiler.
    compiler : tuple of str
        Its command on a machine of another kind, if the library can be built there.
    """

    machine: str
    triple: str
    processor: str
    file: str
    level: int
    flags: tuple[str, ...]
    compiler: tuple[str, ...] = ()


SHARED = "-O2", "-shared", "-fvisibility=hidden", "-Wall", "-Wextra", "-Werror", "-s"
OF_LINUX = (
    *SHARED, "-fPIC", "-ldl", "-lm", "-Wl,--build-id=none", "-Wl,--no-undefined",
    "-Wl,-z,noexecstack", "-Wl,-z,nodelete",
)  # fmt: skip
TARGETS = {
    "x86-64-v4": Target(
        "x86_64", "x86_64-unknown-linux-gnu", "x86-64-v4", "libmagmotor-x86-64-v4.so", 4,
        OF_LINUX,
    ),
    "x86-64-v3": Target(
        "x86_64", "x86_64-unknown-linux-gnu", "x86-64-v3", "libmagmotor-x86-64-v3.so", 3,
        OF_LINUX,
    ),
    "aarch64": Target(
        "aarch64", "aarch64-unknown-linux-gnu", "generic", "libmagmotor-aarch64.so", 0,
        OF_LINUX, ("aarch64-linux-gnu-gcc",),
    ),
    "apple-silicon": Target(
        "arm64", "arm64-apple-macosx11.0", "apple-m1", "libmagmotor-apple-silicon.dylib", 0,
        (*SHARED, "-Wl,-install_name,@rpath/libmagmotor-apple-silicon.dylib"),
        (sys.executable, "-m", "ziglang", "cc", "-target", "aarch64-macos.11.0"),
    ),
    "windows": Target(
        "AMD64", "x86_64-pc-windows-gnu", "x86-64-v3", "magmotor-windows.dll", 3,
        (*SHARED, "-static-libgcc", "-Wl,--no-insert-timestamp"), ("x86_64-w64-mingw32-gcc",),
    ),
}  # fmt: skip
"""By the names of the libraries. The one for Apple's processors has not been run."""

NEEDED = {
    3: {"avx2", "bmi2", "fma"},
    4: {"avx512bw", "avx512dq", "avx512vl"},
}
"""Flags in /proc/cpuinfo that processors of a level have, besides those of lower ones."""


def here() -> tuple[str, ...]:
    """Return the names of libraries for processors of this machine, best first."""
    return LEVELS.get(platform.machine(), ()) if sys.platform == "linux" else ()


def runs_here(name: str) -> bool:
    """Whether the processor has all instructions of a kind."""
    found = {*Path("/proc/cpuinfo").read_text(encoding="utf-8").split()}
    return NEEDED.get(TARGETS[name].level, set()) <= found


def optimized_for(name: str) -> str:
    """Return LLVM's name of the processor for which Numba optimizes the code of a library."""
    native = here()
    return TARGETS[name if name in native else native[-1]].processor


def compiler(name: str) -> tuple[str, ...]:
    """Return the command of a C compiler for a library.

    Raises
    ------
    FileNotFoundError
        It is not installed.
    """
    given = tuple(shlex.split(os.environ.get("CC", "cc")))
    command = given if name in here() else TARGETS[name].compiler
    if shutil.which(command[0]) is None:
        raise FileNotFoundError(f"The C compiler {command[0]} is not installed.")
    if "ziglang" in command and find_spec("ziglang") is None:
        raise FileNotFoundError("The Python package ziglang is not installed: pip install ziglang.")
    return command


# Decrements a number in memory, and tells whether it became 0 (4 is the code of that condition).
COUNTING = "llvm.x86.atomic.sub.cc.i64"
COUNTED = """
define internal i8 @magmotor_counted(ptr %place, i64 %count, i32 %condition) alwaysinline {
  %before = atomicrmw sub ptr %place, i64 %count seq_cst
  %became = icmp eq i64 %before, %count
  %result = zext i1 %became to i8
  ret i8 %result
}"""


def emit(code: str, name: str, path: Path) -> None:
    """Write the machine code of a module to an object file.

    Parameters
    ----------
    code : str
        The module, in LLVM's language.
    name : str
        The library for which it is made.
    path : Path

    Raises
    ------
    ValueError
        The code contains instructions of another processor.
    """
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = TARGETS[name]
    machine = llvm.Target.from_triple(target.triple).create_target_machine(
        cpu=target.processor, opt=3, reloc="pic", codemodel="default"
    )
    code = re.sub(rf"^declare i8 @{COUNTING}\(.*$", COUNTED, code, flags=re.MULTILINE)
    code = code.replace(COUNTING, "magmotor_counted")
    code = re.sub(r"^(attributes .*)\bnoinline\b", r"\1alwaysinline", code, flags=re.MULTILINE)
    if re.search(r"call i8 @magmotor_counted\((?!.*, i32 4\))", code):
        raise ValueError("the code counts with another condition")
    if foreign := re.findall(r"@(llvm\.(?:x86|aarch64)\.[\w.]+)", code):
        raise ValueError(f"the code calls {foreign[0]}, which not all processors have")
    header = f'target datalayout = "{machine.target_data}"\ntarget triple = "{target.triple}"\n'
    code = re.sub(r"^target (datalayout|triple) = .*\n", "", code, flags=re.MULTILINE)
    module = llvm.parse_assembly(header + code)
    passes = llvm.create_new_module_pass_manager()
    passes.add_always_inliner_pass()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_strip_dead_prototype_pass()
    # Numba optimized each function, but not together with what it calls here: up to 30 %. Most
    # arrays have no references to count, which the code sees where the counting is inlined.
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = False
    options.inlining_threshold = 500
    builder = llvm.create_pass_builder(machine, options)
    passes.run(module, builder)
    builder.getModulePassManager().run(module, builder)
    module.verify()
    path.write_bytes(machine.emit_object(module))
