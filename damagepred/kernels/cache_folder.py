"""The folder of compiled kernels. Only its owner may write there: numba's index files are pickles, which can run code.

Each level of the path is checked as ``sshd`` checks a home folder: it belongs to the user or to root, and no other user
may write to it. A folder that all may write to is accepted where it is sticky, as ``/tmp`` is. The levels that this
package makes belong to the user, have mode 0700, and are no links.
"""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

OTHERS_MAY_WRITE = stat.S_IWGRP | stat.S_IWOTH


def _candidates() -> Iterator[tuple[Path, str]]:
    """Yield the folders that may hold the cache, best first, each with the folder that this package makes in it."""
    if asked := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(asked), ""
    if user := os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA"):
        yield Path(user), "damagepred"
    else:
        with contextlib.suppress(RuntimeError):  # a user without a home
            yield Path.home() / ".cache", "damagepred"
    owner = f"-{os.getuid()}" if hasattr(os, "getuid") else ""
    yield Path(tempfile.gettempdir()), f"damagepred{owner}"


def cache_folder(name: str) -> Path | None:
    """Make the folder of compiled kernels, and return it, or None without a safe and writable place."""
    for base, own in _candidates():
        folder = base.absolute() / own / name
        try:
            base.mkdir(parents=True, exist_ok=True)
            if _is_private(folder, base.absolute()):
                return folder
        except OSError:
            continue
    return None


def kept_folders() -> list[Path]:
    """Folders of compiled kernels on the disk, of this version and others."""
    return sorted({folder for base, own in _candidates() for folder in (base.absolute() / own).glob("kernels-*")})


def _is_private(folder: Path, base: Path) -> bool:
    """Make the levels of ``folder`` below ``base``; tell whether only the user can write to it."""
    if not hasattr(os, "getuid"):  # Windows: the profile of a user is private
        folder.mkdir(parents=True, exist_ok=True)
    elif not all(map(_is_safe, (*_levels(base), *_levels(base.resolve())))):
        return False
    else:
        below = [level for level in reversed(_levels(folder)) if level != base and base in level.parents]
        if not all(map(_make_own, below)):
            return False
    with tempfile.TemporaryFile(dir=folder):
        return True


def _levels(folder: Path) -> tuple[Path, ...]:
    """Return the folder and all above it."""
    return (folder, *folder.parents)


def _is_safe(level: Path) -> bool:
    """Whether only the user and root can replace the files of a folder, or the target of a link."""
    found = os.lstat(level)
    if found.st_uid not in (os.getuid(), 0):
        return False
    if stat.S_ISLNK(found.st_mode) or found.st_mode & stat.S_ISVTX:
        return True
    if found.st_mode & stat.S_IWGRP and found.st_gid != os.getgid():  # a user's own group is allowed
        return False
    return not found.st_mode & stat.S_IWOTH


def _make_own(level: Path) -> bool:
    """Make a folder that only the user may read and write; tell whether it is one."""
    level.mkdir(mode=0o700, exist_ok=True)
    found = os.lstat(level)
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & OTHERS_MAY_WRITE
