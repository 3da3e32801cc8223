"""Whole results in plain lines, compared with lists that are kept beside the tests.

A list that is missing is written, and its test fails once: check the result before the list is committed. A line names
one part of a result; its numbers may differ in their last digit.
"""

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

SEPARATOR = " | "
NUMBER = re.compile(r"(?<![\w#.])[-+]?(?:\d+\.?\d*(?:e[-+]?\d+)?|inf|nan)(?!\w)")


def number(values: Any) -> str:
    return " ".join(f"{v + 0.0:.4g}" for v in np.ravel(values).astype(float))


def data(values: Any) -> str:
    """Few numbers as they are; of many the shape, ends, mean, and a mean that depends on their order."""
    values = np.ma.filled(np.ma.asarray(values, dtype=float), np.nan)
    if values.size <= 6:
        return f"[{number(values)}]"
    known = values[np.isfinite(values)]
    order = np.nan_to_num(values.ravel(), posinf=9.0) @ np.cos(np.arange(values.size)) / values.size
    shape, ends = "x".join(map(str, values.shape)), (known.min(initial=np.inf), known.max(initial=-np.inf))
    return f"[{shape}: {number(ends)}; {number(known.mean() if known.size else np.nan)} {number(round(order, 9))}]"


def alike(line: str, recorded: str) -> bool:
    """Whether two lines have the same words, and numbers that differ in their last digit at most."""
    if NUMBER.sub("", line) != NUMBER.sub("", recorded):
        return False
    new, old = (np.array([float(n) for n in NUMBER.findall(text)]) for text in (line, recorded))
    return len(new) == len(old) and bool(np.allclose(new, old, rtol=2e-3, atol=2e-9, equal_nan=True))


def check(file: Path, lines: Sequence[str]) -> None:
    """Compare lines with a list, in their order."""
    if not file.exists():
        file.parent.mkdir(exist_ok=True)
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        pytest.fail(f"{file.name} is written: check the result, and commit it")
    recorded = file.read_text(encoding="utf-8").splitlines()
    changed = [f"- {old}\n+ {new}" for new, old in zip(lines, recorded) if not alike(new, old)]
    assert not changed, "\n".join(changed)
    assert len(lines) == len(recorded)


def check_parts(file: Path, parts: Mapping[str, str]) -> None:
    """Compare named parts with a list, a line of which has all parts of one table; parts that it does not name pass."""
    if not file.exists():
        tables = groupby(parts.items(), key=lambda part: part[0].split(".")[0])
        check(file, [SEPARATOR.join(f"{name} = {value}" for name, value in table) for _, table in tables])
    lines = file.read_text(encoding="utf-8").splitlines()
    recorded = dict(part.split(" = ", 1) for line in lines for part in line.split(SEPARATOR))
    changed = [
        f"{name}\n- {old}\n+ {parts.get(name, 'missing')}"
        for name, old in recorded.items()
        if not alike(parts.get(name, ""), old)
    ]
    assert not changed, "\n".join(changed)


def parts_of(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Names and values of all numbers and words in a result."""
    fields = getattr(value, "_fields", None)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [field.name for field in dataclasses.fields(value) if not field.name.startswith("_")]
    if fields is not None:
        for key in fields:
            yield from parts_of(getattr(value, key), f"{name}.{key}" if name else key)
    elif isinstance(value, xr.Dataset):
        for key in value.variables:
            yield from parts_of(value[key].values, f"{name}.{key}")
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from parts_of(item, f"{name}.{key}")
    elif isinstance(value, np.ndarray) and value.dtype.names:
        for key in value.dtype.names:
            yield from parts_of(value[key], f"{name}.{key}")
    elif value is None or isinstance(value, str | Enum | bool):
        yield name, str(value).replace("\n", " / ")
    elif isinstance(value, np.ndarray) and value.dtype.kind not in "biuf":
        yield name, " ".join(map(str, value.ravel()))
    elif isinstance(value, set | frozenset):
        yield name, " ".join(sorted(map(str, value)))
    elif isinstance(value, list | tuple) and not all(isinstance(v, int | float | np.number) for v in value):
        for number_, item in enumerate(value):
            yield from parts_of(item, f"{name}.{number_}")
    elif not callable(value):
        yield name, data(value)
