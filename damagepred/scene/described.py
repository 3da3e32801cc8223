"""Tables of a scene: frozen, validated dataclasses built from mappings; errors name key, value and remedy."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, TypeVar, dataclass_transform, get_args, get_origin

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError, model_validator
from pydantic.dataclasses import dataclass as _pydantic_dataclass
from pydantic_core import ArgsKwargs

from damagepred.errors import InputError, likely_unit, nearest, shown
from damagepred.inputs.documentation import documented
from damagepred.scene.material_library import with_removals
from damagepred.scene.quantity import Quantity

T = TypeVar("T")


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(Field,))
def described(cls: type[T]) -> type[T]:
    """Frozen dataclass with keyword-only, validated fields; unknown keys are refused.

    Construction in Python raises the errors of a scene file: ``InputError``, caused by pydantic's error. ``stated``
    holds the values of a call in Python; it is empty after ``dataclasses.replace``, which passes all fields.
    """
    config = ConfigDict(extra="forbid", allow_inf_nan=False)
    make: Callable[[type[T]], Any] = _pydantic_dataclass(frozen=True, kw_only=True, config=config)
    made = make(cls)
    checked = made.__init__

    @wraps(checked)
    def init(self: Any, *args: Any, **fields: Any) -> None:
        try:
            checked(self, *args, **fields)
        except ValidationError as error:
            raise complaint(cls, error, cls.__name__) from error
        stated = fields if len(fields) < number else {}
        object.__setattr__(self, "stated", stated)
        if stated and hasattr(self, "_require_consistent"):
            self._require_consistent(self, cls.__name__)

    number = len(dataclasses.fields(made))
    made.__init__ = init
    return documented(made)


def completed_by(complete: Callable[[Mapping[str, Any]], Mapping[str, Any]]) -> Any:
    """Validator of a described class that completes the keys given in a file or a call before they are checked."""

    def validator(given: Any) -> Any:
        if isinstance(given, ArgsKwargs):
            return ArgsKwargs(given.args, dict(complete(given.kwargs or {})))
        return complete(given) if isinstance(given, Mapping) else given

    return model_validator(mode="before")(validator)


def require_name(item: Any, what: str, example: str) -> None:
    """Refuse a name of an item of a list that is no word, or is one of its keys."""
    name, keys = item.name, [field.name for field in dataclasses.fields(item)]
    if name is not None and (not name.replace("-", "_").isidentifier() or name in keys):
        raise ValueError(
            f"name = '{name}': must be one word of letters, digits, - and _, no number and no key of the {what}, such "
            f"as '{example}'"
        )


BOUNDS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
"""Key of the bound in pydantic's errors, and its words."""


def build(kind: type[T], tables: Mapping[str, Any], source: str) -> T:
    """Described object of a class from nested mappings."""
    if not isinstance(tables, Mapping):
        raise InputError(f"{source} = {shown(tables)}: must be a table with keys.")
    try:
        return TypeAdapter(kind).validate_python(dict(tables))
    except ValidationError as error:
        raise complaint(kind, error, source) from None


def complaint(kind: type, error: ValidationError, source: str) -> InputError:
    """Error for values that a described class refuses, one line each."""
    lines = list(dict.fromkeys(_error_line(kind, problem) for problem in _once_a_place(error.errors())))
    return InputError("\n".join(f"{source}: {line}" for line in lines))


def plain(value: Any) -> Any:
    """Described object as nested dicts and lists of plain values, without None and empty lists."""
    if dataclasses.is_dataclass(value):
        items = ((f.name, plain(getattr(value, f.name))) for f in dataclasses.fields(value))
        return with_removals({name: item for name, item in items if item is not None and item != []})
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    return value


def _once_a_place(problems: list[Any]) -> list[Any]:
    """Problems with one entry per location for union types."""
    first: dict[tuple[Any, ...], Any] = {}
    for problem in problems:
        location = problem["loc"]
        either = bool(location) and location[-1] in ("float", "int", "str")
        path = location[:-1] if either else location
        first.setdefault(path if either else (*path, problem["type"]), {**problem, "loc": path})
    return list(first.values())


def _error_line(kind: type, problem: Any) -> str:
    """Sentence on one error of pydantic (``ValidationError.errors``)."""
    location = [str(step) for step in problem["loc"]]
    value, limits = problem.get("input"), problem.get("ctx", {})
    key = _place(location)
    match problem["type"]:
        case "unexpected_keyword_argument" | "unexpected_positional_argument":
            holder = _inner(_follow(kind, location[:-1]))
            allowed = [] if holder is None else [field.name for field in dataclasses.fields(holder)]
            takes = f"; {_place(location[:-1]) or 'the top level'} takes {', '.join(allowed)}." if allowed else "."
            return f"unknown key {key}{takes}" + nearest(location[-1], allowed)
        case "missing" | "missing_keyword_only_argument":
            return f"{key}: is missing; give it a value."
        case "greater_than" | "greater_than_equal" | "less_than" | "less_than_equal":
            limit, words = BOUNDS[problem["type"]]
            bound, unit = limits[limit], unit_of(kind, location)
            text = f"{bound:g}" + ("" if unit == "1" else f" {unit.replace('**', '')}")
            hint = likely_unit(value, bound, unit) if limit.startswith("l") else ""
            return f"{key} = {shown(value)}: must be {words} {text}.{hint}"
        case "finite_number":
            return f"{key} = {shown(value)}: must be a finite number."
        case "literal_error":
            allowed = [word.strip(" '") for word in limits["expected"].replace(" or ", ",").split(",")]
            return f"{key} = {shown(value)}: must be {limits['expected']}.{nearest(str(value), allowed)}"
        case "dataclass_type" | "dataclass_exact_type" if location and location[-1].isdigit():
            return f"{key} = {shown(value)}: must be a table that starts with [[{'.'.join(location[:-1])}]]."
        case "dataclass_type" | "dataclass_exact_type" | "dict_type":
            return f"{key} = {shown(value)}: must be a table, [{'.'.join(location)}] with keys."
        case "tuple_type" if _inner(_follow(kind, location)) is not None:
            return f"{key} = {shown(value)}: must be a list of tables; each starts with [[{'.'.join(location)}]]."
        case "tuple_type":
            return f"{key} = {shown(value)}: must be a list, in square brackets."
        case "too_long":
            return f"{key} = {shown(value)}: must have {limits['max_length']} values, not {limits['actual_length']}."
        case "value_error":
            return _own_words(key, value, str(limits["error"]))
        case _:
            return f"{key} = {shown(value)}: {problem['msg'][0].lower()}{problem['msg'][1:]}."


def _own_words(key: str, value: Any, message: str) -> str:
    """Message with key and value, unless it names several keys itself."""
    end = "" if message.endswith((".", "?")) else "."
    if isinstance(value, int | float | str):
        return f"{key} = {shown(value)}: {message}{end}"
    return f"{key}: {message}{end}" if key else f"{message}{end}"


def _place(location: list[str]) -> str:
    """``[wall] length`` for a key in a table, ``[[opening]] number 2, width`` for a key in a list."""
    if not location:
        return ""
    if len(location) == 1:
        return location[0]
    if location[-1].isdigit() and len(location) > 2:  # a number in a list, such as movement.table
        return f"{_place(location[:-1])}, item {int(location[-1]) + 1}"
    if at := next((i for i, step in enumerate(location) if step.isdigit()), 0):
        rest = ".".join(location[at + 1 :])
        return f"[[{'.'.join(location[:at])}]] number {int(location[at]) + 1}" + (f", {rest}" if rest else "")
    return f"[{'.'.join(location[:-1])}] {location[-1]}"


def _inner(kind: Any) -> Any:
    """Dataclass inside ``X``, ``X | None`` or ``tuple[X, ...]``, or None."""
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        return kind
    return next((inner for argument in get_args(kind) if (inner := _inner(argument)) is not None), None)


def _follow(kind: Any, location: list[str]) -> Any:
    for step in location:
        if get_origin(kind) is tuple:  # number or name of an item
            kind = get_args(kind)[0]
            continue
        if step.isdigit():
            continue
        holder = _inner(kind)
        field = getattr(holder, "__pydantic_fields__", {}).get(step) if holder is not None else None
        if field is None:
            return None
        kind = field.annotation if not field.metadata else (field.annotation, field.metadata)
    return kind


def unit_of(kind: Any, location: list[str]) -> str:
    """SI unit of the field at a location, ``"1"`` for a pure number or no number."""
    return next((mark.unit for mark in _marks(_follow(kind, location))), "1")


def takes_number(kind: Any, location: list[str]) -> bool:
    """Whether the field at a location may be a real number."""
    return bool(_marks(_follow(kind, location)))


def _marks(annotation: Any) -> list[Any]:
    """All quantities inside an annotation."""
    if isinstance(annotation, tuple | list):
        return [mark for nested in annotation for mark in _marks(nested)]
    if isinstance(annotation, Quantity):
        return [annotation]
    return _marks(list(get_args(annotation))) if get_args(annotation) else []
