"""Objects of the bus that a forked child inherits and must not destroy.

Nodes, ports and samples are registered in shared memory under the process that made them. A child that closed its
copies, also by exiting, would remove those of its parent. So a child never destroys inherited iceoryx2 objects. They
end with the process.
"""

import ctypes
import os
import weakref
from abc import ABC, abstractmethod


class Heirloom(ABC):
    """An object that holds iceoryx2 objects."""

    def __init__(self) -> None:
        _HEIRLOOMS.add(self)

    @abstractmethod
    def disown(self) -> None:
        """Leaves the iceoryx2 objects to the parent. Called in a forked child, before any other code runs there."""


def never_destroy(thing: object) -> None:
    """Keeps an object alive after its last reference, and after the end of the interpreter."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))


def _disown_all() -> None:
    for heirloom in list(_HEIRLOOMS):
        heirloom.disown()


_HEIRLOOMS: weakref.WeakSet[Heirloom] = weakref.WeakSet()
os.register_at_fork(after_in_child=_disown_all)
