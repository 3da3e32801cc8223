"""Files that a user names. Regular files of bounded size are read completely; others are refused in one sentence."""

from __future__ import annotations

import json
import os
import stat
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

from damagepred.errors import InputError, nearest

MIB = 2**20
LARGEST_DESCRIPTION = 16 * MIB
"""Largest file of a scene, a study or other settings (bytes)."""
LARGEST_TABLE = 512 * MIB  # largest table of numbers (bytes)
DEEPEST = 32  # tables and lists inside each other in a description
LARGEST_WHOLE = 2**63  # whole numbers of TOML have 64 bits


def read_bytes(path: str | Path, largest: int = LARGEST_DESCRIPTION) -> bytes:
    """Content of a regular file of at most ``largest`` bytes."""
    try:
        with opened(Path(path), largest) as stream:
            return stream.read(largest)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None


def opened(file: Path, largest: int | None = None) -> BinaryIO:
    """Open a regular file of at most ``largest`` bytes; opening a pipe without a writer does not wait for one."""
    try:
        handle = os.open(file, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise InputError(f"{file}: no such file.{_similar(file)}") from None
    except PermissionError:
        raise InputError(f"{file}: may not be read; check its permissions.") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror}).") from None
    except ValueError as error:
        raise InputError(f"{str(file)!r}: no file can have this name ({error}).") from None
    found = os.fstat(handle)
    if stat.S_ISREG(found.st_mode) and (largest is None or found.st_size <= largest):
        return os.fdopen(handle, "rb")
    os.close(handle)
    if stat.S_ISDIR(found.st_mode):
        raise InputError(f"{file}: is a folder; give the file itself.")
    if largest is None or not stat.S_ISREG(found.st_mode):
        raise InputError(f"{file}: is no regular file.")
    raise InputError(f"{file}: has {found.st_size / MIB:.0f} MiB; a file of this kind has at most {largest / MIB:.0f}.")


def _similar(file: Path) -> str:
    try:
        return nearest(file.name, [p.name for p in file.parent.glob(f"*{file.suffix}")] if file.parent.is_dir() else [])
    except OSError:
        return ""


def read_text(path: str | Path, largest: int = LARGEST_DESCRIPTION) -> str:
    """Text of a file in UTF-8, with or without a byte order mark."""
    return as_text(read_bytes(path, largest), path)


def as_text(content: bytes, source: str | Path) -> str:
    """Text of a file in UTF-8, or in UTF-16 with its byte order mark; ``source``: its name, for messages."""
    try:
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(
            f"{source}: is not a text file in UTF-8 (it may be Latin-1 or another code); save it as UTF-8."
        ) from None
    if "\0" in text[:1000]:
        raise InputError(f"{source}: is not a text file in UTF-8 (it may be UTF-16); save it as UTF-8.")
    return text


def read_toml(path: str | Path) -> dict[str, Any]:
    """Tables of a TOML file."""
    return parse_toml(read_text(path), path)


def parse_toml(text: str, source: str | Path) -> dict[str, Any]:
    """Tables of a TOML text; ``source``: where it comes from, for messages."""
    try:
        content = tomllib.loads(text.replace("\r\n", "\n"))
        _check_size(content, 0)
    except RecursionError:
        raise InputError(f"{source}: tables or lists lie more than {DEEPEST} deep inside each other.") from None
    except ValueError as error:
        why = f"{source}: is not valid TOML: {error}. Strings need quotes; tables look like [wall]."
        raise InputError(why) from None
    return content


def parse_json(content: bytes, source: str | Path) -> dict[str, Any]:
    """JSON object from a text in UTF-8; ``source``: name of the file, for messages."""
    try:
        found = json.loads(as_text(content, source))
    except InputError:
        raise
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: is not valid JSON ({type(error).__name__}: {error}).") from None
    if not isinstance(found, dict):
        raise InputError(f"{source}: holds no JSON object.")
    return found


def _check_size(value: Any, depth: int) -> None:
    """Check how deep values lie and how large whole numbers are."""
    if depth > DEEPEST:
        raise RecursionError
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            _check_size(item, depth + 1)
    elif isinstance(value, int) and not -LARGEST_WHOLE <= value < LARGEST_WHOLE:
        raise ValueError("a whole number has more than 64 bits; write it with an exponent")
