"""Digests: a file of a study ends with the SHA-256 of its content and the hash of the study it belongs to.

In TOML the end is a comment, in JSON it is two more keys, and readers of netCDF do not look beyond the last variable.
Besides the SHA-256, which ``damagepred verify`` computes, there is a CRC-32 that each reading computes: it is cheap and
tells any change of up to 32 bits in a row.
"""

from __future__ import annotations

import hashlib
import json
import re
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from damagepred.archive.versions import brought_up_to_date
from damagepred.errors import DamagedError
from damagepred.inputs.input_files import opened, parse_json, read_bytes

SINCE = 4
"""Schema version from which on files of a study have digests."""

NO_STUDY = "-" * 16
"""In place of a study's hash, in a file that belongs to none."""

_END = re.compile(
    rb"(?:\n# crc32 (?P<crc32>[0-9a-f]{8}) sha256 (?P<sha256>[0-9a-f]{64}) study (?P<study>[0-9a-f]{16}|-{16})\n"
    rb'|,\n  "study_hash": "(?P<json_study>[0-9a-f]{16}|-{16})",\n  "sha256": "(?P<json_sha256>[0-9a-f]{64})"\n}\n)\Z'
)
_LONGEST = 256
_BLOCK = 2**17


def study_hash(text: str) -> str:
    """Return the hash of a study: 16 hexadecimal digits of the SHA-256 of its frozen copy.

    Parameters
    ----------
    text : str
        The frozen copy.
    """
    return hashlib.sha256(text.encode("utf-8")).hexdigest()[:16]


def signed(content: bytes, study: str = NO_STUDY) -> bytes:
    """Return the content of a netCDF or TOML file with its digest at the end.

    Parameters
    ----------
    content : bytes
        Without digest.
    study : str
        Hash of the study.
    """
    return content + _end(hashlib.sha256(content), zlib.crc32(content), study)


def _end(digest: Any, crc: int, study: str) -> bytes:
    digest.update(study.encode())
    crc = zlib.crc32(study.encode(), crc)
    return f"\n# crc32 {crc:08x} sha256 {digest.hexdigest()} study {study}\n".encode()


def sign(file: Path, study: str = NO_STUDY) -> None:
    """Append its digest to a file.

    Parameters
    ----------
    file : Path
        Of netCDF.
    study : str
        Hash of the study.
    """
    with file.open("rb+") as stream:
        digest, crc = hashlib.sha256(), 0
        while block := stream.read(_BLOCK):
            digest.update(block)
            crc = zlib.crc32(block, crc)
        stream.write(_end(digest, crc, study))


def signed_json(record: Mapping[str, Any], study: str) -> str:
    """Return the text of a JSON object with its digest in it.

    Parameters
    ----------
    record : mapping
        Plain values.
    study : str
        Hash of the study.
    """
    text = json.dumps(record, indent=2).removesuffix("\n}")
    digest = hashlib.sha256(text.encode("utf-8") + study.encode()).hexdigest()
    return f'{text},\n  "study_hash": "{study}",\n  "sha256": "{digest}"\n}}\n'


def signature(file: str | Path, whole: bool = False) -> str | None:
    """Check the checksum of a file.

    Parameters
    ----------
    file : str or Path
        The file.
    whole : bool
        Whether to compute the SHA-256 too.

    Returns
    -------
    str or None
        Hash of the study it belongs to; None if it has no digest, as files of older versions and of other programs.

    Raises
    ------
    DamagedError
        If its content is not what was written.
    InputError
        If it cannot be read.
    """
    with opened(Path(file)) as stream:
        size = stream.seek(0, 2)
        stream.seek(max(0, size - _LONGEST))
        found = _END.search(stream.read())
        if found is None:
            return None
        left = size - len(found[0])
        stream.seek(0)
        digest, crc = hashlib.sha256() if whole or found["crc32"] is None else None, 0
        block = memoryview(bytearray(_BLOCK))  # one for all: fresh memory costs more than the checksum
        while left > 0 and (count := stream.readinto(block[: min(left, _BLOCK)])):  # type: ignore[attr-defined]
            crc = zlib.crc32(block[:count], crc)
            if digest is not None:
                digest.update(block[:count])
            left -= count
    return _compared(digest, crc, found, file)


def verified(content: bytes, source: str | Path) -> tuple[bytes, str | None]:
    """Check the checksum of what was read.

    Parameters
    ----------
    content : bytes
        Of a file.
    source : str or Path
        The file, for the message.

    Returns
    -------
    tuple of bytes and (str or None)
        Content without digest, but of JSON as it is; and the study's hash as ``signature`` returns it.

    Raises
    ------
    DamagedError
        If it is not what was written.
    """
    found = _END.search(content, max(0, len(content) - _LONGEST))
    if found is None:
        return content, None
    body = memoryview(content)[: found.start()]
    if found["crc32"] is None:
        return content, _compared(hashlib.sha256(body), 0, found, source)
    study = _compared(None, zlib.crc32(body), found, source)
    return content[: found.start()], study


def _compared(digest: Any, crc: int, found: re.Match[bytes], source: str | Path) -> str:
    study = found["study"] or found["json_study"]
    wrong = found["crc32"] is not None and f"{zlib.crc32(study, crc):08x}".encode() != found["crc32"]
    if digest is not None:
        digest.update(study)
        wrong |= digest.hexdigest().encode() != (found["sha256"] or found["json_sha256"])
    if wrong:
        raise DamagedError(f"{source}: is damaged or was edited: its digest differs.")
    return study.decode()


def check_study(found: str | None, expected: str, version: int, source: str | Path) -> None:
    """Check that a file belongs to a study.

    Parameters
    ----------
    found : str or None
        What ``signature`` has returned.
    expected : str
        Hash of the study.
    version : int
        Schema version of the file.
    source : str or Path
        The file, for the message.

    Raises
    ------
    DamagedError
        If it is of another study, or has lost its digest.
    """
    if found is None and version >= SINCE:
        raise DamagedError(f"{source}: is damaged, or was written by another program: it has no digest.")
    if found not in (None, expected):
        raise DamagedError(f"{source}: belongs to another study.")


def read_signed_json(path: str | Path, study: str | None = None) -> dict[str, Any]:
    """Read a JSON object and check its digest.

    Parameters
    ----------
    path : str or Path
        The file.
    study : str, optional
        Hash of the study it must belong to.

    Raises
    ------
    InputError
        If it cannot be read, is no JSON object, is damaged, newer than this package, or belongs to another study.
    """
    content, found = verified(read_bytes(path), path)
    record = parse_json(content, path)
    version = record.get("schema_version")
    if isinstance(version, int) and version > 0:
        brought_up_to_date(version, str(path))
    if study is not None:
        check_study(found, study, version if isinstance(version, int) else 0, path)
    return {key: value for key, value in record.items() if key not in ("study_hash", "sha256")}
