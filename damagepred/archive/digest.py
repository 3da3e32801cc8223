"""Digests: a file of a study ends with the SHA-256 of its content and the hash of the study it belongs to.

In TOML it is a comment, in JSON two more keys, and readers of netCDF ignore bytes after the last variable. The SHA-256
is computed by ``damagepred verify`` only; each reading computes a CRC-32, which is cheap and detects any change of up
to 32 bits in a row.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

from damagepred.archive.versions import brought_up_to_date
from damagepred.errors import DamagedError
from damagepred.inputs.input_files import opened, parse_json, read_bytes

SINCE = 4  # schema version from which on files of a study have digests
NO_STUDY = "-" * 16  # placeholder for the hash in files without a study

_END = re.compile(
    rb"(?:\n# crc32 (?P<crc32>[0-9a-f]{8}) sha256 (?P<sha256>[0-9a-f]{64}) study (?P<study>[0-9a-f]{16}|-{16})\n"
    rb'|,\n  "study_hash": "(?P<json_study>[0-9a-f]{16}|-{16})",\n  "sha256": "(?P<json_sha256>[0-9a-f]{64})"\n}\n)\Z'
)
_LONGEST = 256
_BLOCK = 2**17


def study_hash(text: str) -> str:
    """Hash of a study: 16 hexadecimal digits of the SHA-256 of its frozen copy."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()[:16]


def signed(content: bytes, study: str = NO_STUDY) -> bytes:
    """Content of a netCDF or TOML file with its digest at the end."""
    return content + _end(hashlib.sha256(content), zlib.crc32(content), study)


def _end(digest: Any, crc: int, study: str) -> bytes:
    digest.update(study.encode())
    crc = zlib.crc32(study.encode(), crc)
    return f"\n# crc32 {crc:08x} sha256 {digest.hexdigest()} study {study}\n".encode()


def sign(file: Path, study: str = NO_STUDY) -> None:
    """Append its digest to a netCDF file."""
    with file.open("rb+") as stream:
        digest = hashlib.sha256()
        crc = _crc32(stream, stream.seek(0, 2), digest)
        stream.write(_end(digest, crc, study))


def _crc32(stream: BinaryIO, size: int, digest: Any = None) -> int:
    """CRC-32 of the first bytes of a stream, which a digest takes, too."""
    stream.seek(0)
    crc, block = 0, memoryview(bytearray(_BLOCK))  # reused: fresh memory costs more than the checksum
    while size > 0 and (count := stream.readinto(block[: min(size, _BLOCK)])):  # type: ignore[attr-defined]
        crc = zlib.crc32(block[:count], crc)
        if digest is not None:
            digest.update(block[:count])
        size -= count
    return crc


def signed_json(record: Mapping[str, Any], study: str) -> str:
    """JSON object with its digest, as text."""
    text = json.dumps(record, indent=2).removesuffix("\n}")
    digest = hashlib.sha256(text.encode("utf-8") + study.encode()).hexdigest()
    return f'{text},\n  "study_hash": "{study}",\n  "sha256": "{digest}"\n}}\n'


def signature(file: str | Path, whole: bool = False) -> str | None:
    """Hash of the study in a file's digest, after a check of the checksum; None for files without digest."""
    with opened(Path(file)) as stream:
        return _checked(stream, file, whole)[0]


def verified(content: bytes, source: str | Path) -> tuple[bytes, str | None]:
    """Content without its digest (JSON unchanged), and the study's hash as in ``signature``."""
    study, size = _checked(io.BytesIO(content), source)
    return content[:size], study


def _checked(stream: BinaryIO, source: str | Path, whole: bool = False) -> tuple[str | None, int]:
    """Hash of the study in a digest, after a check, and size of the content without it (JSON: of all)."""
    size = stream.seek(0, 2)
    stream.seek(max(0, size - _LONGEST))
    end = _END.search(stream.read())
    if end is None:
        return None, size
    study, is_json = end["study"] or end["json_study"], end["crc32"] is None
    digest = hashlib.sha256() if whole or is_json else None
    crc = _crc32(stream, size - len(end[0]), digest)
    wrong = not is_json and f"{zlib.crc32(study, crc):08x}".encode() != end["crc32"]
    if digest is not None:
        digest.update(study)
        wrong |= digest.hexdigest().encode() != (end["sha256"] or end["json_sha256"])
    if wrong:
        raise DamagedError(f"{source}: is damaged or was edited: its digest differs.")
    return study.decode(), size if is_json else size - len(end[0])


def check_study(study: str | None, expected: str, version: int, source: str | Path) -> None:
    """Check that a file belongs to a study, by the hash in its digest."""
    if study is None and version >= SINCE:
        raise DamagedError(f"{source}: is damaged, or was written by another program: it has no digest.")
    if study not in (None, expected):
        raise DamagedError(f"{source}: belongs to another study.")


def read_signed_json(path: str | Path, study: str | None = None) -> dict[str, Any]:
    """JSON object from a file with digest; a damaged, newer or foreign file raises InputError."""
    content, file_study = verified(read_bytes(path), path)
    record = parse_json(content, path)
    version = record.get("schema_version")
    if isinstance(version, int) and version > 0:
        brought_up_to_date(version, str(path))
    if study is not None:
        check_study(file_study, study, version if isinstance(version, int) else 0, path)
    return {key: value for key, value in record.items() if key not in ("study_hash", "sha256")}
