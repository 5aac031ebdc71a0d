"""Checks that the machine has enough resources for a client. Without them, iceoryx2 would be killed by SIGBUS or fail
while it opens a service."""

import errno
import os

from bench_dragon.errors import OutOfResources
from bench_dragon.membership import SHARED_MEMORY

_SHARED_MEMORY_BYTES = 256 << 10
_OPEN_FILES = 32


def require_shared_memory() -> None:
    """Checks that shared memory has space for a client, by allocating as much for a moment. This also respects a quota
    or the limit of a control group."""
    try:
        file = os.open(SHARED_MEMORY, os.O_TMPFILE | os.O_RDWR | os.O_CLOEXEC, 0o600)
        try:
            os.posix_fallocate(file, 0, _SHARED_MEMORY_BYTES)
        finally:
            os.close(file)
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            needed_mb = _SHARED_MEMORY_BYTES * 1e-6
            text = f"has less than the {needed_mb:.1f} MB free that this process needs: free some or mount it larger"
        else:
            text = f"cannot be written ({error.strerror}): mount it, `mount -t tmpfs -o mode=1777 tmpfs /dev/shm`"
        raise OutOfResources(f"{SHARED_MEMORY} {text}") from error


def require_open_files() -> None:
    """Checks that this process may open as many files as a client needs, by opening that many for a moment."""
    files: list[int] = []
    try:
        while len(files) < _OPEN_FILES:
            files.append(os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC))
    except OSError as error:
        if error.errno not in (errno.EMFILE, errno.ENFILE):
            raise
        raise OutOfResources(
            f"this process may not open the {_OPEN_FILES} more files that it needs: raise the limit, `ulimit -n 1024`"
        ) from error
    finally:
        for file in files:
            os.close(file)
