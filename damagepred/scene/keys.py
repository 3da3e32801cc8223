"""Keys of a scene: dotted names of tables and values; entries of lists by their name, or by their number from 1."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from damagepred.errors import InputError


def step_names(items: Sequence[Any]) -> list[str]:
    """Names of the items of a list in keys: their own, or their number from 1."""
    names = [item.get("name") if isinstance(item, Mapping) else getattr(item, "name", None) for item in items]
    return [str(name or number) for number, name in enumerate(names, start=1)]


def entry_number(items: Sequence[Any], step: str) -> int:
    """Number from 0 of the entry of a list with a name, or a number from 1; -1 if there is none."""
    names = step_names(items)
    number = int(step) if step.isdecimal() else names.index(step) + 1 if step in names else 0
    return number - 1 if number <= len(names) else -1


def require_own_names(key: str, items: Sequence[Any], what: str) -> None:
    """Refuse two entries of a list with one name (ValueError)."""
    names = step_names(items)
    if twice := [name for name in names if names.count(name) > 1]:
        raise ValueError(f"{key}: two {what} have the name '{twice[0]}'; give each its own")


def key_values(tables: Mapping[str, Any], table: str = "") -> Iterator[tuple[str, Any]]:
    """Keys of nested tables, such as ``joint.friction``, and their values; an empty table is a value."""
    for name, value in tables.items():
        if isinstance(value, Mapping) and value:
            yield from key_values(value, f"{table}{name}.")
        else:
            yield f"{table}{name}", value


def written_values(tables: Any, key: str = "") -> list[tuple[str, Any]]:
    """Keys of all values in nested tables and lists of tables, each with the value as written."""
    if isinstance(tables, Mapping):
        pairs = [(str(name), value) for name, value in tables.items()]
    elif isinstance(tables, list) and any(isinstance(item, Mapping) for item in tables):
        pairs = list(zip(step_names(tables), tables))
    else:
        return [(key, tables)]
    return [nested for name, value in pairs for nested in written_values(value, f"{key}.{name}" if key else name)]


def field_values(described: Any, key: str = "") -> list[tuple[str, Any]]:
    """Keys of all values in a described object, items of tuples included."""
    if dataclasses.is_dataclass(described):
        pairs = [(f.name, getattr(described, f.name)) for f in dataclasses.fields(described)]
    elif isinstance(described, tuple):
        pairs = list(zip(step_names(described), described))
    else:
        return [(key, described)]
    return [nested for name, item in pairs for nested in field_values(item, f"{key}.{name}" if key else name)]


def merged(tables: Any, changes: Mapping[str, Any], table: str = "") -> Any:
    """Copy of a scene's tables with other values, by key or in tables; ``wall.thickness`` is of all walls of a house.

    ``table``: key of the tables themselves, for messages.
    """
    for key, value in changes.items():
        step, _, rest = key.partition(".")
        change, path = {rest: value} if rest else value, f"{table}.{step}" if table else step
        nested = isinstance(change, Mapping)
        if isinstance(tables, list):
            if not nested and all(isinstance(entry, Mapping) and "start" in entry for entry in tables):
                tables = [{**wall, step: change} for wall in tables]
                continue
            if (number := entry_number(tables, step)) < 0:
                raise InputError(f"{path}: there is no such {table}; the study has {', '.join(step_names(tables))}.")
            old = tables[number]
        else:
            old = tables.get(step)
        if nested and not isinstance(old, Mapping | list):
            if any(name.split(".")[0].isdigit() for name in change):
                raise InputError(f"{path}: the study has none; give one there first.")
            old = {}
        new = merged(old, change, path) if nested else change
        tables = [*tables[:number], new, *tables[number + 1 :]] if isinstance(tables, list) else {**tables, step: new}
    return tables


def differing_keys(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[str]:
    """Keys in which two nested tables differ, each with both values."""
    was, now = dict(key_values(first)), dict(key_values(second))
    return [
        f"{key} (was {was.get(key)!r}, is {now.get(key)!r})"
        for key in sorted({*was, *now})
        if was.get(key) != now.get(key)
    ]
