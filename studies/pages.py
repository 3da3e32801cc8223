"""What several studies do alike: name version and machine, and write tables into their pages."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

import pandas as pd

from damagepred.archive.files import write_whole
from damagepred.runtime.version import __version__

HERE = Path(__file__).resolve().parent
BEGIN, END = "<!-- written by run.py -->", "<!-- end -->"


def version() -> str:
    """Version of damagepred and, in a clone, the commit, and whether the package has been changed since."""

    def git(*arguments: str) -> str:
        done = subprocess.run(["git", "-C", str(HERE), *arguments], capture_output=True, text=True, check=True)
        return done.stdout.strip()

    try:
        commit, changed = git("rev-parse", "--short=10", "HEAD"), git("status", "--porcelain", "--", ":/damagepred")
    except (OSError, subprocess.CalledProcessError):
        return __version__
    return f"{__version__}, commit {commit}{' and changes' if changed else ''}"


def package() -> str:
    """Hash of the files of the package in the commit; "" outside a clone."""
    words = ["git", "-C", str(HERE), "rev-parse", "--short=10", "HEAD:damagepred"]
    return subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip()


def processor_model() -> str:
    """Model of the processor, with its cache and whether it has AVX-512."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    told = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    wide = ", AVX-512" if "avx512f" in told.get("flags", "").split() else ""
    model = told.get("model name") or platform.processor() or platform.machine()
    return f"{model} ({told.get('cache size', '')}{wide})"


def machine() -> str:
    """Machine, in general terms."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    libraries = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "numba", "scipy"))
    return (
        f"{os.cpu_count()} cores of a {processor_model()}, "
        f"{memory:.0f} GiB, {platform.system()}, Python {platform.python_version()}, {libraries}"
    )


def markdown(rows: pd.DataFrame) -> str:
    """Table of a page, numbers with three digits."""

    def cell(value: Any) -> str:
        if isinstance(value, float):
            return "" if value != value else f"{value:.3g}"
        return str(value)

    lines = ["| " + " | ".join(map(str, rows.columns)) + " |", "|" + "---|" * len(rows.columns)]
    lines += ["| " + " | ".join(map(cell, row)) + " |" for row in rows.itertuples(index=False)]
    return "\n".join(lines)


def put_in(page: Path, text: str, begin: str = BEGIN, end: str = END) -> None:
    """Write into a page, between its marks; a page without them is an error."""
    before, _, rest = page.read_text(encoding="utf-8").partition(begin)
    _, mark, after = rest.partition(end)
    if not mark:
        raise ValueError(f"{page}: no {begin} ... {end} in it")
    whole = f"{before}{begin}\n\n{text}\n\n{end}{after}"
    write_whole(page, lambda p: p.write_text(whole, encoding="utf-8"))
