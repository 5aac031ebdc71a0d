"""Removes the nodes of killed processes while other processes are in the domain, with a journal per node. The steps and
files are those of `ipc/src/dead_nodes.rs`, which gives the reasons."""

import contextlib
import fcntl
import os
import shutil
import stat
import time
from collections.abc import Iterator
from pathlib import Path

import iceoryx2 as iox2

from bench_dragon.domain import Domain
from bench_dragon.membership import SHARED_MEMORY

_END = "end"
_NO_PROCESS = bytes(16)
_SIGHTINGS = 4
_LOOK_PERIOD_S = 0.05
_MOST_LOOKS = 20


def remove_dead_nodes(domain: Domain) -> None:
    """Removes all dead nodes that no other process is removing.

    Raises `OSError` where the domain's directory cannot be written.
    """
    _settle(domain)
    prefix = _journal_prefix(domain)
    ids = [path.name.removeprefix(prefix) for path in domain.root.iterdir() if path.name.startswith(prefix)]
    for id in ids:
        # Opening a journal restores the node's missing files, so that the node is listed.
        if journal := _Journal.open(domain, id):
            journal.close()
    try:
        nodes = iox2.Node.list(iox2.ServiceType.Ipc, domain.iceoryx2_config())
    except iox2.NodeListFailure:
        return
    for node in nodes:
        match node:
            case iox2.NodeState.Dead(view):
                if journal := _Journal.open(domain, str(view.id.value)):
                    _remove(view, journal)


def _settle(domain: Domain) -> None:
    """Removes empty segments whose creator was killed before they had a size: iceoryx2 waits for them without a time
    limit. `ipc/src/half_made_segments.rs` gives the reasons."""
    sightings: dict[tuple[Path, int], int] = {}
    for _ in range(_MOST_LOOKS):
        sightings = {segment: sightings.get(segment, 0) + 1 for segment in _empty_segments(domain)}
        if not sightings:
            return
        for (path, _), seen in sightings.items():
            if seen >= _SIGHTINGS:
                path.unlink(missing_ok=True)
        time.sleep(_LOOK_PERIOD_S)


def _empty_segments(domain: Domain) -> Iterator[tuple[Path, int]]:
    for path in SHARED_MEMORY.iterdir():
        if path.name.startswith(domain.prefix):
            with contextlib.suppress(OSError):
                metadata = path.lstat()
                if stat.S_ISREG(metadata.st_mode) and not metadata.st_size and metadata.st_uid == os.geteuid():
                    yield path, metadata.st_ino


def _remove(view: iox2.DeadNodeView, journal: "_Journal") -> None:
    try:
        view.try_remove_stale_resources()
    except iox2.NodeCleanupFailure as failure:
        # On any other failure the journal remains, and the next member tries again.
        if str(failure) == "ResourcesAlreadyCleanedUp":
            journal.finish()
    else:
        journal.finish()
    finally:
        journal.close()


def _journal_prefix(domain: Domain) -> str:
    """Returns the prefix of journal names. It begins with the domain's prefix, so a journal is removed with the domain.
    """
    return f"{domain.prefix}cleaning-"


class _Journal:
    """Journal of one dead node. While it is open, only this process removes that node."""

    def __init__(self, domain: Domain, id: str, path: Path, file: int) -> None:
        nodes = domain.root / "nodes"
        self._directory = nodes / id
        self._details = self._directory / f"{domain.prefix}node.details"
        self._monitor = nodes / f"{domain.prefix}{id}.node_monitor"
        self._owner_lock = self._monitor.with_name(f"{self._monitor.name}_owner_lock")
        self._context = self._monitor.with_name(f"{self._monitor.name}_context")
        self._path = path
        self._file = file

    @classmethod
    def open(cls, domain: Domain, id: str) -> "_Journal | None":
        """Opens a journal. Returns `None` if another process removes the node, or has just removed it."""
        path = domain.root / f"{_journal_prefix(domain)}{id}"
        journal = cls(domain, id, path, os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600))
        try:
            if journal._begin():
                return journal
        except BaseException:
            journal.close()
            raise
        journal.close()
        return None

    def _begin(self) -> bool:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if not os.path.samestat(os.fstat(self._file), self._path.stat()):
                return False
        except (BlockingIOError, FileNotFoundError):
            return False
        *tags, last = self._path.read_text().splitlines() or [""]
        if last == _END:
            self._restore(tags)
        else:
            # Nothing has been removed yet.
            os.ftruncate(self._file, 0)
            os.write(self._file, "".join(f"{line}\n" for line in (*self._port_tags(), _END)).encode())
        if self._details.exists():
            return True
        self.finish()
        return False

    def finish(self) -> None:
        """Removes the journal, after the files that a killed process may have left of a removed node."""
        for path in (self._monitor, self._owner_lock, self._context):
            path.unlink(missing_ok=True)
        with contextlib.suppress(FileNotFoundError):
            shutil.rmtree(self._directory)
        self._path.unlink(missing_ok=True)

    def close(self) -> None:
        """Drops the lock."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _port_tags(self) -> list[str]:
        try:
            return [path.name for path in self._directory.iterdir() if path.name.endswith(".port_tag")]
        except FileNotFoundError:
            return []

    def _restore(self, tags: list[str]) -> None:
        if not self._details.exists():
            return
        for tag in tags:
            _make(self._directory / tag, b"", 0o400)
        _make(self._context, _NO_PROCESS, 0o400)
        _make(self._owner_lock, b"", 0o600)
        _make(self._monitor, b"", 0o600)


def _make(path: Path, content: bytes, mode: int) -> None:
    """Creates a file, unless it exists."""
    with contextlib.suppress(FileExistsError):
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
        try:
            os.write(file, content)
        finally:
            os.close(file)
