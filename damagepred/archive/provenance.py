"""Where a result comes from."""

from __future__ import annotations

import subprocess
from functools import lru_cache
from pathlib import Path
from typing import Any

from damagepred.version import __version__


@lru_cache(maxsize=1)
def package_commit() -> str:
    """Return the commit of the checkout this package runs from, with ``+`` if changed since, or ``"unknown"``."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return "unknown"
    try:
        run = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--abbrev=12", "--dirty=+", "--exclude=*"],
            capture_output=True, text=True, timeout=10, check=True,
        )  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return run.stdout.strip() or "unknown"


def provenance() -> dict[str, Any]:
    """Return the global attributes that say which program made a result."""
    return {
        "source": f"damagepred {__version__}",
        "damagepred_version": __version__,
        "damagepred_commit": package_commit(),
    }
