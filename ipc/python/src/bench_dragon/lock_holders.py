"""Finds the processes that hold a lock, and whether they are ending, as `ipc/src/lock_holders.rs` does.

The kernel drops the locks of a killed process when it closes the files of that process, some time after the signal.
`/proc/locks` names the holders of a lock, and `/proc/PID` shows which of them are ending.
"""

import enum
import os
from collections.abc import Iterator
from pathlib import Path

_PF_EXITING = 0x4
_SIGKILL = 1 << 8


class Holders(enum.Enum):
    """The processes that hold a lock."""

    LIVING = enum.auto()
    """All of them run, or are stopped and can continue."""
    ENDING = enum.auto()
    """At least one of them is ending: it was killed, or exits."""
    UNSEEN = enum.auto()
    """None is listed: the lock was dropped just now, or this process may not see its holders."""


def holders(file: int) -> Holders:
    """Looks up the holders of the `flock` on an open file."""
    try:
        pids = list(_pids(os.fstat(file).st_ino))
    except OSError:
        return Holders.UNSEEN
    if not pids:
        return Holders.UNSEEN
    return Holders.ENDING if any(map(is_ending, pids)) else Holders.LIVING


def _pids(inode: int) -> Iterator[int]:
    for line in Path("/proc/locks").read_text().splitlines():
        match line.split():
            case [_, "FLOCK", _, _, pid, file, *_] if file.rpartition(":")[2] == str(inode) and pid.isdecimal():
                yield int(pid)


def is_ending(pid: int) -> bool:
    """Whether a process is ending or has ended. A stopped process is not ending, nor is one whose files cannot be read.
    """
    folder = Path(f"/proc/{pid}")
    try:
        # The program's name, in parentheses, may contain anything.
        state, *fields = (folder / "stat").read_text().rpartition(")")[2].split()
        if state in "ZX" or int(fields[5]) & _PF_EXITING:
            return True
        for line in (folder / "status").read_text().splitlines():
            name, _, value = line.partition(":")
            if name in ("SigPnd", "ShdPnd") and int(value, 16) & _SIGKILL:
                return True
    except (FileNotFoundError, ProcessLookupError):
        return True
    except OSError:
        pass
    return False
