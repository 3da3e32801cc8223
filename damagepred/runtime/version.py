"""Version of the package, and hash of the sources of kernels."""

from __future__ import annotations

import hashlib
import sys
from functools import cache
from pathlib import Path

__version__ = "0.1.0"


@cache
def kernel_hash() -> str:
    """Return a hash of the sources of all kernels, of numba's version and of Python's: of the same, the same code."""
    from importlib.metadata import version  # slow to import, and most imports need no hash

    digest = hashlib.sha256(f"{version('numba')} {sys.version_info[:3]}".encode())
    for source in sorted((Path(__file__).parents[1] / "kernels").rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
