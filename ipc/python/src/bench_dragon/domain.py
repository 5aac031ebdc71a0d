"""Domain of an instance: its name, its directory and its iceoryx2 configuration.

Each instance is an iceoryx2 domain of its own, so two shows on one machine do not interfere. Root path:
`$XDG_RUNTIME_DIR/bench-dragon/NAME`, else `/tmp/bench-dragon-UID/NAME`; prefix `bd_UID_NAME_`.
"""

import contextlib
import json
import os
import re
import stat
from pathlib import Path
from typing import Any

import iceoryx2 as iox2

from bench_dragon.errors import DomainError, MissingDirectory

MAX_ROOT_PATH_LEN = 60
"""Exclusive limit of the root path's length, in bytes. The path plus iceoryx2's suffixes must fit into a socket
address."""


class Domain:
    """iceoryx2 domain of an instance of the user who runs this process. The constructor accesses nothing on disk.

    Raises `DomainError` for a name that is not 1 to 24 characters of a-z, 0-9 and -. Raises it also for a root path that
    is relative, has 60 bytes or more, or has characters that iceoryx2 does not allow.
    """

    def __init__(self, instance: str) -> None:
        if not re.fullmatch("[a-z0-9-]{1,24}", instance):
            raise DomainError(f"instance is {instance!r}, must be 1 to 24 of a-z, 0-9 and -")
        user = os.geteuid()
        runtime_dir = os.environ.get("XDG_RUNTIME_DIR")
        base = Path(runtime_dir, "bench-dragon") if runtime_dir else Path(f"/tmp/bench-dragon-{user}")
        self.instance = instance
        """The instance's name."""
        self.root = base / instance
        """The root path."""
        self.prefix = f"bd_{user}_{instance}_"
        """Prefix of all names of the domain in shared memory."""
        encoded = os.fsencode(self.root)
        if not self.root.is_absolute() or not _is_usable(encoded) or len(encoded) >= MAX_ROOT_PATH_LEN:
            shown = re.sub(r"[\x00-\x1f\x7f-\x9f]", "\ufffd", encoded.decode(errors="replace"))
            raise DomainError(
                f"the bus directory is {shown}, must be absolute, under {MAX_ROOT_PATH_LEN} bytes and of printable ASCII "
                'characters but <>"|?*: set XDG_RUNTIME_DIR to another path or unset it'
            )

    def iceoryx2_config(self) -> Any:
        """Returns the configuration of every iceoryx2 node of this domain. iceoryx2's own removal of dead nodes is
        disabled: a member removes them when it joins."""
        config = iox2.config.default()
        config.global_cfg.root_path = iox2.Path.new(str(self.root))
        config.global_cfg.prefix = iox2.FileName.new(self.prefix)
        config.global_cfg.node.cleanup_dead_nodes_on_creation = False
        config.global_cfg.node.cleanup_dead_nodes_on_destruction = False
        config.global_cfg.service.cleanup_dead_nodes_on_open = False
        return config

    def set_fallback_configuration(self) -> None:
        """Makes this domain's configuration the fallback of iceoryx2 in this process. iceoryx2 uses the fallback where
        it cannot read the details of a killed node; without it, iceoryx2 would search another domain for the node's
        files."""
        if not self.iceoryx2_toml_path.exists():
            # The name has the domain's prefix, so a draft that a killed process leaves is removed with the domain.
            draft = self.root / f"{self.prefix}{os.getpid()}.draft"
            draft.write_text(
                f"[global]\nroot-path = {json.dumps(str(self.root))}\nprefix = {json.dumps(self.prefix)}\n"
            )
            draft.rename(self.iceoryx2_toml_path)
        # A configuration of another domain may already be set in this process.
        with contextlib.suppress(Exception):
            iox2.config.setup_global_config_from_file(iox2.FilePath.new(str(self.iceoryx2_toml_path)))

    @property
    def iceoryx2_toml_path(self) -> Path:
        """Path of the domain's iceoryx2 configuration file, which exists while a process is in the domain."""
        return self.root / "iceoryx2.toml"

    def check_directory(self) -> None:
        """Checks that this user owns the directory and that other users may not write into it.

        Raises `MissingDirectory` if it does not exist, and `DomainError` with the path in question for other errors.
        """
        _check_runtime_directory(self.root.parent.parent)
        _check_own(self.root.parent)
        _check_own(self.root)


def _is_usable(encoded: bytes) -> bool:
    """Whether iceoryx2 allows these bytes in a path."""
    return all(0x20 <= byte < 0x7F and byte not in b'<>"|?*' for byte in encoded)


def _check_runtime_directory(path: Path) -> None:
    """Checks the parent of the domain's directories. Other users may write into it only if it is sticky like `/tmp`, so
    that they cannot remove foreign files."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise DomainError(f"XDG_RUNTIME_DIR is {path}, must be an existing directory: {error.strerror}") from error
    if not stat.S_ISDIR(mode):
        raise DomainError(f"{path} is not a directory: remove it")
    if mode & 0o022 and not mode & stat.S_ISVTX:
        raise _writable_by_others(path, mode)


def _check_own(path: Path) -> None:
    try:
        metadata = path.lstat()
    except FileNotFoundError as error:
        raise MissingDirectory(f"the bus directory {path} does not exist") from error
    except PermissionError as error:
        raise DomainError(
            f"permission denied on the bus directory {path}: run as the user who runs the server"
        ) from error
    if not stat.S_ISDIR(metadata.st_mode):
        raise DomainError(f"{path} is not a directory: remove it")
    user = os.geteuid()
    if metadata.st_uid != user:
        raise DomainError(
            f"the bus directory {path} belongs to user {metadata.st_uid}, must belong to user {user}: "
            "run as that user or remove it"
        )
    if metadata.st_mode & 0o022:
        raise _writable_by_others(path, metadata.st_mode)


def _writable_by_others(path: Path, mode: int) -> DomainError:
    return DomainError(
        f"the bus directory {path} has mode {stat.S_IMODE(mode):04o}, must not be writable by others: chmod 0700 it"
    )
