"""What lies in shared memory: structures of C layout under a versioned type name.

iceoryx2 opens a service only where name, size and alignment are those of the server's type.
"""

import ctypes
import enum
from typing import Any, ClassVar, Self, TypeVar

_MOST_SHOWN = 6


class WireType(ctypes.Structure):
    """A structure of the bus."""

    TYPE_NAME: ClassVar[str]

    @classmethod
    def type_name(cls) -> str:
        """The name under which iceoryx2 compares types."""
        return cls.TYPE_NAME

    @classmethod
    def copy_from(cls, address: int) -> Self:
        """A copy of what lies at an address."""
        return cls.from_buffer_copy(ctypes.string_at(address, ctypes.sizeof(cls)))

    def fields(self) -> dict[str, Any]:
        """The values by name; arrays as lists."""
        values = ((field[0], getattr(self, field[0])) for field in self._fields_)
        return {name: list(value) if isinstance(value, ctypes.Array) else value for name, value in values}

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={_shown(value)}" for name, value in self.fields().items())
        return f"{type(self).__name__}({values})"


def _shown(value: Any) -> str:
    """A value as people want to see it; of a long array, such as a histogram, how long it is."""
    is_long = isinstance(value, list) and len(value) > _MOST_SHOWN
    return f"[{len(value)} numbers]" if is_long else repr(value)


class WireCode(enum.IntEnum):
    """A number of the bus that stands for something. Its text is what the commands print."""

    def __str__(self) -> str:
        return self.name.lower().replace("_", " ")


Code = TypeVar("Code", bound=WireCode)


def decoded(codes: type[Code], number: int) -> Code | None:
    """What a number on the wire stands for; `None` where this version does not know it."""
    return next((code for code in codes if code == number), None)
