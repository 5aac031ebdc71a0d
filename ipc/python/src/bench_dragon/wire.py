"""Types in shared memory: structures with C layout and the type name that iceoryx2 compares."""

import ctypes
import enum
from typing import Any, ClassVar, Self, TypeVar

_MOST_SHOWN = 6


class WireType(ctypes.Structure):
    """Base class of the bus's structures."""

    TYPE_NAME: ClassVar[str]
    """Name and version of the layout, as on the bus."""

    @classmethod
    def type_name(cls) -> str:
        """Returns the name of the layout. The package `iceoryx2` compares types by it."""
        return cls.TYPE_NAME

    @classmethod
    def copy_from(cls, address: int) -> Self:
        """Returns a copy of the structure at an address."""
        return cls.from_buffer_copy(ctypes.string_at(address, ctypes.sizeof(cls)))

    def fields(self) -> dict[str, Any]:
        """Returns the values by name, with arrays as lists."""
        values = ((field[0], getattr(self, field[0])) for field in self._fields_)
        return {name: list(value) if isinstance(value, ctypes.Array) else value for name, value in values}

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={_shown(value)}" for name, value in self.fields().items())
        return f"{type(self).__name__}({values})"


def _shown(value: Any) -> str:
    """Returns a value as text; for a long array, such as a histogram, only its length."""
    is_long = isinstance(value, list) and len(value) > _MOST_SHOWN and not isinstance(value[0], ctypes.Structure)
    return f"[{len(value)} numbers]" if is_long else repr(value)


class WireCode(enum.IntEnum):
    """Base class of the bus's numeric codes. The text of a code is the one that the commands print."""

    def __str__(self) -> str:
        return self.name.lower().replace("_", " ")


Code = TypeVar("Code", bound=WireCode)


def decoded(codes: type[Code], number: int) -> Code | None:
    """Returns the code of a number on the wire; `None` if this version does not support it."""
    return next((code for code in codes if code == number), None)
