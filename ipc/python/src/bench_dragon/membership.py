"""Who is in a domain: every process of it holds a shared lock on one file of the domain's directory. The kernel drops
the lock with the process, however that ends, so an exclusive lock proves that nobody else is there.

Whoever is alone in a domain, the first to join and the last to leave, takes away what killed processes have left there,
and what iceoryx2 itself never removes. This is what `ipc/src/membership.rs` does, in the same steps.
"""

import contextlib
import fcntl
import os
import shutil
from pathlib import Path

import iceoryx2 as iox2

from bench_dragon.domain import Domain
from bench_dragon.errors import DomainError, MissingDirectory

SHARED_MEMORY = Path("/dev/shm")
"""Where shared memory lives in the file system."""

_DIRECTORIES = ("nodes", "services")


class Membership:
    """One membership in a domain whose directory is there. Waits only while somebody else clears the domain up."""

    def __init__(self, domain: Domain) -> None:
        self._domain = domain
        try:
            self._file = self._join()
        except FileNotFoundError as error:
            raise MissingDirectory(f"the bus directory {domain.root} is not there") from error
        except OSError as error:
            raise DomainError(f"{error.filename or _lock_path(domain)}: {error.strerror}") from error

    def _join(self) -> int:
        path = _lock_path(self._domain)
        while True:
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(file, fcntl.LOCK_SH)
                if self._is_alone(file):
                    _sweep(self._domain)
                fcntl.flock(file, fcntl.LOCK_SH)
                # The last one to leave may have removed the file before it let go.
                if _is_at(file, path):
                    return file
            except BaseException:
                os.close(file)
                raise
            os.close(file)

    def leave(self, own_node: int | None = None) -> None:
        """Gives the membership up. Whoever is the last takes the whole domain away, even where a node of its own, given
        by its id, is still there."""
        if self._is_alone(self._file, own_node):
            # Whatever stays is swept away by the next one to join.
            with contextlib.suppress(OSError):
                _dissolve(self._domain)
        os.close(self._file)

    def disown(self) -> None:
        """Closes the file in a forked child. A lock by `flock` is the open file's, which the parent has too: it stays
        until the parent closes it, and a child that lives on does not prolong it."""
        os.close(self._file)

    def _is_alone(self, file: int, own_node: int | None = None) -> bool:
        """Whether nobody else is in the domain. Tries for the exclusive lock; where that fails, the shared one may be
        lost."""
        return _lock_exclusively(file) and not _has_other_node(self._domain, own_node)


def _lock_path(domain: Domain) -> Path:
    return domain.root / "members.lock"


def _lock_exclusively(file: int) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _is_at(file: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except FileNotFoundError:
        return False


def _has_other_node(domain: Domain, own_node: int | None) -> bool:
    try:
        nodes = iox2.Node.list(iox2.ServiceType.Ipc, domain.iceoryx2_config())
    except iox2.NodeListFailure:
        return True
    for node in nodes:
        match node:
            case iox2.NodeState.Inaccessible():
                return True
            case iox2.NodeState.Alive(view) if view.id.value != own_node:
                return True
    return False


def _sweep(domain: Domain) -> None:
    """Removes everything of iceoryx2's from a domain in which nobody is."""
    for folder in (SHARED_MEMORY, domain.root):
        for path in folder.iterdir():
            if path.name.startswith(domain.prefix):
                path.unlink()
    for name in _DIRECTORIES:
        with contextlib.suppress(FileNotFoundError):
            shutil.rmtree(domain.root / name)


def _dissolve(domain: Domain) -> None:
    """Removes the whole domain."""
    _sweep(domain)
    for name in ("source.lock", "guard.lock"):
        _clear_abandoned(domain.root / name)
    domain.iceoryx2_toml_path.unlink(missing_ok=True)
    _lock_path(domain).unlink()
    domain.root.rmdir()


def _clear_abandoned(path: Path) -> None:
    """Removes a lock file that nobody holds."""
    with contextlib.suppress(FileNotFoundError):
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        try:
            if _lock_exclusively(file):
                path.unlink()
        finally:
            os.close(file)
