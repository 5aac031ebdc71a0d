"""Where an instance lives: its name, its directory and its iceoryx2 configuration.

Each instance is an iceoryx2 domain of its own, so that two shows on one machine never meet. Root path:
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
"""Longest root path in bytes: what iceoryx2 appends to it has to fit into a socket address."""


class Domain:
    """The iceoryx2 domain of an instance of the user who runs this process. Touches nothing on disk by itself.

    Raises `DomainError` for a name that is not 1 to 24 of a-z, 0-9 and -, and where the root path is relative, not
    UTF-8 or too long.
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
        """The prefix of everything that the domain puts into shared memory."""
        encoded = os.fsencode(self.root)
        if not self.root.is_absolute() or not _is_usable(encoded) or len(encoded) >= MAX_ROOT_PATH_LEN:
            shown = re.sub(r"[\x00-\x1f\x7f-\x9f]", "\ufffd", encoded.decode(errors="replace"))
            raise DomainError(
                f"the bus directory is {shown}, must be absolute, under {MAX_ROOT_PATH_LEN} bytes and of printable ASCII "
                'characters but <>"|?*: set XDG_RUNTIME_DIR to another path or unset it'
            )

    def iceoryx2_config(self) -> Any:
        """The configuration of every iceoryx2 node of this domain. Dead nodes are removed by us, when a member joins."""
        config = iox2.config.default()
        config.global_cfg.root_path = iox2.Path.new(str(self.root))
        config.global_cfg.prefix = iox2.FileName.new(self.prefix)
        config.global_cfg.node.cleanup_dead_nodes_on_creation = False
        config.global_cfg.node.cleanup_dead_nodes_on_destruction = False
        config.global_cfg.service.cleanup_dead_nodes_on_open = False
        return config

    def set_fallback_configuration(self) -> None:
        """Makes this domain's configuration the one that iceoryx2 falls back on in this process: it does so where the
        details of a node that was killed cannot be read, and would look for its remains in another domain."""
        if not self.iceoryx2_toml_path.exists():
            # By the prefix, so that one that a killed process leaves is swept away.
            draft = self.root / f"{self.prefix}{os.getpid()}.draft"
            draft.write_text(
                f"[global]\nroot-path = {json.dumps(str(self.root))}\nprefix = {json.dumps(self.prefix)}\n"
            )
            draft.rename(self.iceoryx2_toml_path)
        # Another domain's of this process may be there already.
        with contextlib.suppress(Exception):
            iox2.config.setup_global_config_from_file(iox2.FilePath.new(str(self.iceoryx2_toml_path)))

    @property
    def iceoryx2_toml_path(self) -> Path:
        """Where the domain's iceoryx2 configuration lies while somebody is in it."""
        return self.root / "iceoryx2.toml"

    def check_directory(self) -> None:
        """Checks that the directory is ours alone.

        Raises `MissingDirectory` where it is not there, and `DomainError` with the path that is wrong.
        """
        _check_runtime_directory(self.root.parent.parent)
        _check_own(self.root.parent)
        _check_own(self.root)


def _is_usable(encoded: bytes) -> bool:
    """Whether iceoryx2 takes these characters in a path."""
    return all(0x20 <= byte < 0x7F and byte not in b'<>"|?*' for byte in encoded)


def _check_runtime_directory(path: Path) -> None:
    """Checks the directory that ours are in: others may write into it only as into `/tmp`, without removing what is not
    theirs."""
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
