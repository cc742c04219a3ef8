"""Types of C functions, in the words of Numba, which need not be there."""

from typing import NamedTuple


class CType(NamedTuple):
    """A type of C; called with those of arguments, it returns a signature with it as the result."""

    name: str

    def __call__(self, *arguments: "CType") -> "Signature":
        """Return a signature."""
        return Signature(self, arguments)

    def __str__(self) -> str:
        """Return Numba's name."""
        return self.name


class Signature(NamedTuple):
    """The types of a C function."""

    result: CType
    arguments: tuple[CType, ...]

    def __str__(self) -> str:
        """Return Numba's text, such as "void(int64, int64)"."""
        return f"{self.result}({', '.join(map(str, self.arguments))})"


void, boolean, int32, int64, uint64, float64 = map(
    CType, ("void", "boolean", "int32", "int64", "uint64", "float64")
)
