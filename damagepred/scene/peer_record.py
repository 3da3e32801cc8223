"""Records of ground motion in the format of the PEER databases (AT2, VT2, DT2)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.inputs.input_files import LARGEST_TABLE, as_text, opened, read_bytes
from damagepred.scene.quantity import LARGEST, to_si

HEAD = 10  # lines in which the head ends
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_ROW = re.compile(rf"\s*{_NUMBER}(?:\s+{_NUMBER}|(?=[-+]){_NUMBER})*\s*")  # full columns touch at their signs
_UNITS = re.compile(r"IN UNITS OF\s+([A-Z0-9/*^]+)", re.IGNORECASE)
_STEPS = (
    re.compile(rf"NPTS\s*=\s*(?P<count>\d+)\s*,?\s*DT\s*=\s*(?P<step>{_NUMBER})(?:\s*SEC)?", re.IGNORECASE),
    re.compile(rf"(?P<count>\d+)\s+(?P<step>{_NUMBER})\s+NPTS\s*,\s*DT", re.IGNORECASE),  # older files
)


def is_peer_record(path: Path) -> bool:
    """Whether a file is a PEER record, by its name or its head."""
    with opened(path, LARGEST_TABLE) as stream:
        return path.suffix.lower() in (".at2", ".vt2", ".dt2") or b"NPTS" in stream.read(2000)


def read_peer_record(path: Path, unit: str) -> tuple[FloatArray, FloatArray, float, str]:
    """Times from 0 (s), values (SI), and their unit in the file as factor and text."""
    lines = as_text(read_bytes(path, LARGEST_TABLE), path).splitlines()
    found = ((n, match) for n, line in enumerate(lines[:HEAD]) for form in _STEPS if (match := form.search(line)))
    head, step = next(found, (0, None))
    if step is None:
        raise InputError(
            f"{path}: has no line 'NPTS= 4000, DT= .0050 SEC' among its first {HEAD}; it is no PEER record."
        )
    count, interval = int(step["count"]), float(step["step"])
    if not (count >= 2 and 0 < interval <= LARGEST):
        raise InputError(f"{path}, line {head + 1}: NPTS must be 2 or more and DT greater than 0.")
    units = [match[1] for line in lines[:head] if (match := _UNITS.search(line))]
    if not units:
        raise InputError(f"{path}: has no line 'ACCELERATION TIME SERIES IN UNITS OF G' before line {head + 1}.")
    try:
        factor = to_si(f"1 {units[0].lower().replace('sec', 's')}", unit)
    except ValueError as error:
        raise InputError(f"{path}: UNITS OF {units[0]}: {error}.") from None
    values: list[float] = []
    for number, line in enumerate(lines[head + 1 :], head + 2):
        if not line.strip():
            continue
        if _ROW.fullmatch(line) is None:
            kept = re.match(rf"(?:\s*{_NUMBER}(?=\s|[-+]|$))*\s*", line)
            column = kept.end() + 1 if kept else 1
            raise InputError(f"{path}, line {number}, character {column}: is no number: {line.strip()[:40]!r}.")
        values.extend(map(float, re.findall(_NUMBER, line)))
    if len(values) != count:
        raise InputError(f"{path}, line {head + 1}: NPTS is {count}, but the file has {len(values)} values.")
    if not np.abs(values).max() <= LARGEST:
        raise InputError(f"{path}: has a value beyond {LARGEST:g}.")
    return interval * np.arange(count, dtype=np.float64), factor * np.array(values), factor, units[0]
