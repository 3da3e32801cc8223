"""The one way fields of a scene are declared: frozen dataclasses that check what they are given."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, dataclass_transform

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as _pydantic_dataclass

T = TypeVar("T")


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(Field,))
def described(cls: type[T]) -> type[T]:
    """Make ``cls`` a frozen dataclass with keyword-only, validated fields; unknown keys are refused."""
    make: Callable[[type[T]], Any] = _pydantic_dataclass(
        frozen=True, kw_only=True, config=ConfigDict(extra="forbid", allow_inf_nan=False)
    )
    return make(cls)
