"""One folder of compiled kernels per process, so that processes that compile at once do not mix up their files.

numba numbers the files of a kernel 1, 2, ...: of two processes that compile it at the same time for different
arguments in one folder, one would load the machine code of the other. A process therefore begins with links to the
shared files, and adds its own to them when it ends.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

OLD = 24 * 3600.0
"""Age (s) from which a folder is removed even if there is a process of its number; a live one makes it again."""


class ProcessCache:
    """Compiled kernels of this process."""

    def __init__(self, shared: Path) -> None:
        self._shared, self._process = shared, os.getpid()
        processes = shared / "processes"
        processes.mkdir(exist_ok=True)
        for other in processes.iterdir():
            with contextlib.suppress(OSError):
                if not _runs(other.name) or time.time() - other.stat().st_mtime > OLD:
                    shutil.rmtree(other, ignore_errors=True)
        self.folder = Path(tempfile.mkdtemp(prefix=f"{self._process}-", dir=processes))
        with self._locked():
            self._known = {file.relative_to(shared): _identity(file) for file in _files(shared)}
            for folder in {name.parent for name in self._known}:
                (self.folder / folder).mkdir(mode=0o700)
            for name in self._known:
                _link_or_copy(shared / name, self.folder / name)

    def publish(self) -> None:
        """Add the kernels compiled here to the shared ones; kernels that another process has added meanwhile stay."""
        with self._locked():
            for index in _files(self.folder, "*.nbi"):
                name = index.relative_to(self.folder)
                target, known = self._shared / name, self._known.get(name)
                if _identity(index) == known or _identity(target) != known:
                    continue
                for file in (*index.parent.glob(f"{index.stem}.*.nbc"), index):  # the index last
                    link(file, self._shared / file.relative_to(self.folder))
                self._known[name] = _identity(target)

    def close(self) -> None:
        """Publish, and remove the folder."""
        if os.getpid() == self._process:  # not in a fork
            with contextlib.suppress(OSError):
                self.publish()
            shutil.rmtree(self.folder, ignore_errors=True)

    @contextlib.contextmanager
    def _locked(self) -> Iterator[None]:
        with (self._shared / "lock").open("w") as lock:
            try:
                import fcntl
            except ImportError:  # Windows
                yield
                return
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield


def in_use(shared: Path) -> bool:
    """Whether a running process may use a folder of compiled kernels."""
    return any(_runs(process.name) for process in shared.glob("processes/*"))


def _runs(name: str) -> bool:
    """Whether the process of a folder may be running."""
    if os.name == "nt":  # signal 0 would end it
        return True
    try:
        os.kill(int(name.partition("-")[0]), 0)
    except (ProcessLookupError, ValueError):
        return False
    except PermissionError:
        pass
    return True


def _files(folder: Path, pattern: str = "*.nb?") -> list[Path]:
    return [file for part in folder.iterdir() if part.name != "processes" for file in part.glob(pattern)]


def _identity(file: Path) -> tuple[int, int] | None:
    """Inode and time of change of a file, of its target for a link; None for a missing file."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def link(file: Path, target: Path) -> None:
    """Put a file in the place of another, in one step; a copy where links are impossible."""
    target.parent.mkdir(mode=0o700, exist_ok=True)
    temporary = target.with_name(f"{target.name}.{os.getpid()}")
    temporary.unlink(missing_ok=True)
    _link_or_copy(file, temporary)
    os.replace(temporary, target)
    temporary.unlink(missing_ok=True)  # POSIX: replacing a link by another link to the same file leaves both


def _link_or_copy(file: Path, target: Path) -> None:
    try:
        os.link(file, target)
    except OSError:
        shutil.copy2(file, target)
