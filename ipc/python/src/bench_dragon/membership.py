"""Membership of a domain. Every membership holds a shared lock (`flock`) on one file of the domain's directory,
`members.lock`. The first member to join and the last to leave remove everything that killed processes have left, and
everything that iceoryx2 itself never removes. The steps are those of `ipc/src/membership.rs`, which proves them.
"""

import contextlib
import enum
import fcntl
import os
import shutil
import time
from pathlib import Path

import iceoryx2 as iox2

from bench_dragon.domain import Domain
from bench_dragon.errors import DomainError, MissingDirectory
from bench_dragon.lock_holders import Holders, holders, is_ending

SHARED_MEMORY = Path("/dev/shm")
"""Folder of shared memory in the file system."""

_DIRECTORIES = ("nodes", "services")
_END_TIMEOUT_S = 10.0
"""Timeout of a leaving member for processes that are ending, and of a joining member for a sweep: much longer than
either takes."""
_UNSEEN_TIMEOUT_S = 0.02
"""Timeout of a leaving member for holders that this process cannot see."""
_TRY_PERIOD_S = 0.001


class _Company(enum.Enum):
    """Other processes in a domain."""

    NOBODY = enum.auto()
    """None; this member holds the exclusive lock."""
    LIVING = enum.auto()
    """At least one lives, and will leave after this member."""
    ENDING = enum.auto()
    """At least one is ending."""
    UNSEEN = enum.auto()
    """There are some, but this process cannot see which."""
    REMOVED = enum.auto()
    """The domain has been removed."""


class Membership:
    """One membership in a domain whose directory exists. Joining waits only while another process sweeps, at most ten
    seconds."""

    def __init__(self, domain: Domain) -> None:
        self._domain = domain
        try:
            self._file = self._join()
        except FileNotFoundError as error:
            raise MissingDirectory(f"the bus directory {domain.root} does not exist") from error
        except OSError as error:
            raise DomainError(f"{error.filename or _lock_path(domain)}: {error.strerror}") from error

    def _join(self) -> int:
        path = _lock_path(self._domain)
        while True:
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            try:
                _share(file, path)
                if _company(self._domain, file, own_pid=None) is _Company.NOBODY:
                    _sweep(self._domain)
                _share(file, path)
                # The last member to leave may have removed the file before it dropped the lock.
                if _is_at(file, path):
                    return file
            except BaseException:
                os.close(file)
                raise
            os.close(file)

    def leave(self) -> None:
        """Ends the membership. The last member removes the whole domain, even if a node of its own process still
        exists. At the end of a process, a held frame keeps such a node."""
        begun_s = time.monotonic()
        while True:
            match _company(self._domain, self._file, own_pid=os.getpid()):
                case _Company.NOBODY:
                    # The next process to join sweeps any remains.
                    with contextlib.suppress(OSError):
                        _dissolve(self._domain)
                    break
                case _Company.LIVING | _Company.REMOVED:
                    break
                case _Company.ENDING:
                    timeout_s = _END_TIMEOUT_S
                case _Company.UNSEEN:
                    timeout_s = _UNSEEN_TIMEOUT_S
            if time.monotonic() - begun_s > timeout_s:
                break
            time.sleep(_TRY_PERIOD_S)
        os.close(self._file)

    def disown(self) -> None:
        """Closes the file in a forked child. A `flock` lock belongs to the open file, which the parent shares. It lasts
        until the parent closes the file, and the child does not prolong it."""
        os.close(self._file)


def _lock_path(domain: Domain) -> Path:
    return domain.root / "members.lock"


def _share(file: int, path: Path) -> None:
    """Takes the shared lock. A sweeping process holds the exclusive lock for some milliseconds, unless it is stopped.
    """
    begun_s = time.monotonic()
    while True:
        try:
            return fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError as error:
            if time.monotonic() - begun_s > _END_TIMEOUT_S:
                raise DomainError(
                    f"{path} is held by a process that is clearing the bus and makes no progress: resume or kill it"
                ) from error
        time.sleep(_TRY_PERIOD_S)


def _company(domain: Domain, file: int, own_pid: int | None) -> _Company:
    """Returns which other processes are in the domain; a given `own_pid` is not counted. Tries for the exclusive lock;
    a refused attempt drops the shared one."""
    if _lock_exclusively(file):
        return _owners_of_nodes(domain, own_pid) if _is_at(file, _lock_path(domain)) else _Company.REMOVED
    match holders(file):
        case Holders.LIVING:
            return _Company.LIVING
        case Holders.ENDING:
            return _Company.ENDING
        case Holders.UNSEEN:
            return _Company.UNSEEN


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


def _owners_of_nodes(domain: Domain, own_pid: int | None) -> _Company:
    """Returns whether other processes have a living node; a given `own_pid` is not counted."""
    try:
        nodes = iox2.Node.list(iox2.ServiceType.Ipc, domain.iceoryx2_config())
    except iox2.NodeListFailure:
        return _Company.UNSEEN
    company = _Company.NOBODY
    for node in nodes:
        match node:
            case iox2.NodeState.Inaccessible():
                return _Company.LIVING
            case iox2.NodeState.Alive(view):
                pid = view.details.process_id if view.details else None
                if own_pid is not None and pid == own_pid:
                    continue
                if pid is None or not is_ending(pid):
                    return _Company.LIVING
                company = _Company.ENDING
    return company


def _sweep(domain: Domain) -> None:
    """Removes all files of iceoryx2 from a domain without processes. Files of other users in shared memory, and files
    there that cannot be removed, are kept: they do no harm."""
    for path in SHARED_MEMORY.iterdir():
        if path.name.startswith(domain.prefix) and path.lstat().st_uid == os.geteuid():
            with contextlib.suppress(OSError):
                _remove(path)
    for path in domain.root.iterdir():
        if path.name.startswith(domain.prefix):
            _remove(path)
    for name in _DIRECTORIES:
        with contextlib.suppress(FileNotFoundError):
            shutil.rmtree(domain.root / name)


def _remove(path: Path) -> None:
    """Removes a file, a link or a directory. The target of a link is not touched."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink()


def _dissolve(domain: Domain) -> None:
    """Removes the whole domain."""
    _sweep(domain)
    for name in ("source.lock", "guard.lock"):
        _clear_abandoned(domain.root / name)
    domain.iceoryx2_toml_path.unlink(missing_ok=True)
    _lock_path(domain).unlink()
    domain.root.rmdir()


def _clear_abandoned(path: Path) -> None:
    """Removes a lock file without a holder. Waits for a holder that is ending until the kernel drops its lock."""
    with contextlib.suppress(FileNotFoundError):
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        begun_s = time.monotonic()
        try:
            while not _lock_exclusively(file):
                if holders(file) is Holders.LIVING or time.monotonic() - begun_s > _END_TIMEOUT_S:
                    return
                time.sleep(_TRY_PERIOD_S)
            path.unlink()
        finally:
            os.close(file)
