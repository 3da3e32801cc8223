"""Version of the package, and hash of the sources of kernels."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

__version__ = "0.2.0"


PACKAGE = Path(__file__).parents[1]


def source_hash(*folders: str) -> str:
    """Hash of the sources in folders of the package, of numba's version and of Python's."""
    from importlib.metadata import version  # slow to import, and most imports need no hash

    digest = hashlib.sha256(f"{version('numba')} {sys.version_info[:3]}".encode())
    for source in sorted(source for folder in folders for source in (PACKAGE / folder).rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
