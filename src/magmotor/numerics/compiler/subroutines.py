"""Functions that only compiled code calls: intermediate code, which becomes part of the caller.

Numba compiles whatever compiled code calls as if Python called it, too: with wrappers for Python,
optimized together with all that it calls, and down to machine code, which nobody runs. Here, it
keeps the intermediate code only, and optimizes it within each function that Python or MuJoCo calls.
"""

from collections.abc import Callable
from typing import Any, NoReturn

from numba import njit, types
from numba.core import config
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature

if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue]
    raise ImportError("NUMBA_DISABLE_JIT is set: unset it, since magmotor needs compiled code")


class Subroutine(CPUDispatcher):
    """A function that only compiled code can call, since it has no wrappers for Python."""

    def __call__(self, *args: Any, **options: Any) -> NoReturn:
        """Raise TypeError. The call itself would end the process."""
        raise TypeError(f"{self.py_func.__qualname__} can be called by compiled code only")

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile once for all constant integers; Numba would do so for each of them."""
        values = {name: _without_constant(kind) for name, kind in kws.items()}
        return super().get_call_template(tuple(map(_without_constant, args)), values)


def _without_constant(kind: Any) -> Any:
    return types.unliteral(kind) if isinstance(kind, types.IntegerLiteral) else kind


def compiled(function: Callable, forceinline: bool, inline: str) -> Any:
    """Return Numba's object for `magmotor.numerics.deferred.subroutine`."""
    options: dict[str, Any] = {
        "inline": inline,
        "error_model": "numpy",
        "no_cpython_wrapper": True,
        "no_cfunc_wrapper": True,
        "forceinline": forceinline,  # else Numba would take it from the first caller
    }
    dispatcher: Any = njit(function, pipeline_class=_SubroutineCompiler, **options)
    dispatcher.__class__ = Subroutine
    return dispatcher


def external(symbol: str, signature: str) -> types.ExternalFunction:
    """Return Numba's object for a C function."""
    arguments, result = normalize_signature(signature)
    assert result is not None
    return types.ExternalFunction(symbol, result(*arguments))


class _SubroutineCompiler(Compiler):
    """Numba's compiler, which keeps the code in a library for subroutines."""

    def define_pipelines(self) -> list:
        """Return the passes of the compiler."""
        if self.state.library is None:
            codegen, name = self.state.targetctx.codegen(), self.state.func_id.func_qualname
            self.state.library = _SubroutineLibrary(codegen, name)
        return super().define_pipelines()


class _SubroutineLibrary(JITCodeLibrary):
    """Intermediate code for linking into the callers' libraries."""

    @property
    def codegen(self) -> Any:
        """Where `set_env` is called."""
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Do nothing: a subroutine uses no Python objects, as `print` would."""

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, which means that there is no machine code of this name."""
        self._ensure_finalized()
        return 0

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True
