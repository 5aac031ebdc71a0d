"""Who is in a domain. Every membership holds a shared lock (`flock`) on one file of the domain's directory,
`members.lock`. The first to join and the last to leave remove what killed processes have left, and what iceoryx2 itself
never removes. This is what `ipc/src/membership.rs` does, which proves the steps.
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
"""Where shared memory lives in the file system."""

_DIRECTORIES = ("nodes", "services")
_PATIENCE_S = 10.0
"""How long a member that leaves waits for processes that are ending, and one that joins for a sweep: far longer than
either takes."""
_PATIENCE_UNSEEN_S = 0.02
"""How long it waits for holders that it cannot see."""
_TRY_PERIOD_S = 0.001


class _Company(enum.Enum):
    """Who else is in a domain."""

    NOBODY = enum.auto()
    """Nobody; this member holds the exclusive lock."""
    LIVING = enum.auto()
    """Somebody who will leave after this member."""
    ENDING = enum.auto()
    """Somebody who is ending."""
    UNSEEN = enum.auto()
    """Somebody who cannot be seen."""
    REMOVED = enum.auto()
    """The domain has been removed."""


class Membership:
    """One membership in a domain whose directory is there. Waits only while another process sweeps, at most ten
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
                # The last one to leave may have removed the file before it let go.
                if _is_at(file, path):
                    return file
            except BaseException:
                os.close(file)
                raise
            os.close(file)

    def leave(self) -> None:
        """Gives the membership up. The last one takes the whole domain away, even where a node of its own process is
        still there: at the end of a process, a frame that is held keeps its node."""
        begun_s = time.monotonic()
        while True:
            match _company(self._domain, self._file, own_pid=os.getpid()):
                case _Company.NOBODY:
                    # Whatever stays is swept by the next one to join.
                    with contextlib.suppress(OSError):
                        _dissolve(self._domain)
                    break
                case _Company.LIVING | _Company.REMOVED:
                    break
                case _Company.ENDING:
                    patience_s = _PATIENCE_S
                case _Company.UNSEEN:
                    patience_s = _PATIENCE_UNSEEN_S
            if time.monotonic() - begun_s > patience_s:
                break
            time.sleep(_TRY_PERIOD_S)
        os.close(self._file)

    def disown(self) -> None:
        """Closes the file in a forked child. A lock by `flock` is the open file's, which the parent has too: it stays
        until the parent closes it, and a child that lives on does not prolong it."""
        os.close(self._file)


def _lock_path(domain: Domain) -> Path:
    return domain.root / "members.lock"


def _share(file: int, path: Path) -> None:
    """Takes the shared lock. A process that sweeps holds the exclusive one for some milliseconds, unless it is
    stopped."""
    begun_s = time.monotonic()
    while True:
        try:
            return fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError as error:
            if time.monotonic() - begun_s > _PATIENCE_S:
                raise DomainError(
                    f"{path} is held by a process that is clearing the bus and makes no progress: resume or kill it"
                ) from error
        time.sleep(_TRY_PERIOD_S)


def _company(domain: Domain, file: int, own_pid: int | None) -> _Company:
    """Who else is in the domain, beside this process where its id is given. Tries for the exclusive lock; where it is
    refused, the shared one is lost."""
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
    """Who has a node that lives, other than this process where its id is given."""
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
    """Removes everything of iceoryx2's from a domain in which nobody is. Files of other users in shared memory stay,
    and so does a file there that cannot be removed: they are in nobody's way."""
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
    """Removes a file, a link or a directory; never what a link leads to."""
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
    """Removes a lock file that nobody holds. Waits for a holder that is ending, until the kernel has dropped its
    lock."""
    with contextlib.suppress(FileNotFoundError):
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        begun_s = time.monotonic()
        try:
            while not _lock_exclusively(file):
                if holders(file) is Holders.LIVING or time.monotonic() - begun_s > _PATIENCE_S:
                    return
                time.sleep(_TRY_PERIOD_S)
            path.unlink()
        finally:
            os.close(file)
