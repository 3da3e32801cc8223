"""Declaration of the tables of a scene: frozen, validated dataclasses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields as fields_of
from functools import wraps
from typing import Any, TypeVar, dataclass_transform

from pydantic import ConfigDict, Field, ValidationError
from pydantic.dataclasses import dataclass as _pydantic_dataclass

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
            from damagepred.scene.reading import complaint

            raise complaint(cls, error, cls.__name__) from error
        stated = fields if len(fields) < number else {}
        object.__setattr__(self, "stated", stated)
        if stated and hasattr(self, "_require_consistent"):
            self._require_consistent(self, cls.__name__)

    number = len(fields_of(made))
    made.__init__ = init
    return made


def require_name(item: Any, what: str, example: str) -> None:
    """Refuse a name of an item of a list that is no word, or is one of its keys."""
    name, keys = item.name, [field.name for field in fields_of(item)]
    if name is not None and (not name.replace("-", "_").isidentifier() or name in keys):
        raise ValueError(
            f"name = '{name}': must be one word of letters, digits, - and _, no number and no key of the {what}, such "
            f"as '{example}'"
        )
