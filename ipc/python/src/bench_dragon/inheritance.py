"""What a forked child inherits of the bus, and must not touch.

Node, ports and samples stand in shared memory under the name of the process that made them. A child that closed its
copies, be it by exiting, would take them from its parent. So a child lets go of nothing of iceoryx2's: what it inherits
is never destroyed there, and ends with the process.
"""

import ctypes
import os
import weakref
from abc import ABC, abstractmethod


class Heirloom(ABC):
    """Something that holds objects of iceoryx2's."""

    def __init__(self) -> None:
        _HEIRLOOMS.add(self)

    @abstractmethod
    def disown(self) -> None:
        """Called in a forked child, before anything else runs there."""


def never_destroy(thing: object) -> None:
    """Keeps an object beyond the last reference to it, and beyond the interpreter's end."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))


def _disown_all() -> None:
    for heirloom in list(_HEIRLOOMS):
        heirloom.disown()


_HEIRLOOMS: weakref.WeakSet[Heirloom] = weakref.WeakSet()
os.register_at_fork(after_in_child=_disown_all)
