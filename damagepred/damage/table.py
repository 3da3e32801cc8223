"""Damage tables: limits of crack width for each category. The limits are data, with their source."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray, Int8Array
from damagepred.damage.limits import level_of
from damagepred.errors import InputError, nearest, require_count, require_number
from damagepred.inputs.arguments import checked
from damagepred.inputs.data_files import data_file
from damagepred.inputs.input_files import read_toml
from damagepred.inputs.text import check_title

TABLES = ("as2870", "bre251")
"""Damage tables that come with the package."""


@dataclass(frozen=True)
class DamageTable:
    """Categories of damage by crack width.

    Attributes
    ----------
    name, source, confidence : str
        Source of the limits, and the level of confidence (``data_files.CONFIDENCE``).
    category_names : tuple of str
        Names of category 0, 1, ...
    limits : tuple of float
        Smallest crack width of category 1, 2, ... (m); a width equal to a limit belongs to the higher category.
    group_category : int
        Least category of a group of wide cracks.
    group_width : float
        Smallest width of a crack in a group (m).
    plasterboard_factor : float or None
        Factor on all widths behind plasterboard, if the table has this allowance.

    Examples
    --------
    >>> from damagepred import damage
    >>> table = damage.load_table("as2870")
    >>> dict(zip(table.category_names[1:], table.limits))
    {'very slight': 0.0001, 'slight': 0.001, 'moderate': 0.005, 'severe': 0.015}
    """

    name: str
    source: str
    confidence: str
    category_names: tuple[str, ...]
    limits: tuple[float, ...]
    group_category: int
    group_width: float
    plasterboard_factor: float | None

    @property
    def highest(self) -> int:
        """Number of the highest category."""
        return len(self.limits)

    def with_plasterboard(self) -> DamageTable:
        """Table with the plasterboard allowance.

        Raises
        ------
        InputError
            If the table has none.
        """
        factor = self.plasterboard_factor
        if factor is None:
            raise InputError(f"damage.plasterboard = true: {self.name} has no such allowance; use table = 'as2870'.")
        return replace(
            self,
            name=f"{self.name}, limits times {factor:g} for plasterboard",
            limits=tuple(v * factor for v in self.limits),
            group_width=self.group_width * factor,
            plasterboard_factor=None,
        )

    def by_width(self, width: FloatArray | float) -> Int8Array:
        """Category of a crack of given width (m), element by element; -1 if NaN."""
        return level_of(width, self.limits)

    def by_width_and_group(self, width: FloatArray | float, group_width: FloatArray | float) -> Int8Array:
        """Category by the widest crack and by a group of cracks, element by element.

        Parameters
        ----------
        width : array or float
            Width of the widest crack (m).
        group_width : array or float
            Width of the narrowest crack in the widest group (m), see ``group_widths``; 0 or NaN without group.
        """
        category = self.by_width(width)
        grouped = level_of(group_width, (self.group_width,)) > 0
        return np.where(grouped, np.maximum(category, self.group_category), category).astype(np.int8)


@checked
@lru_cache(maxsize=8)
def load_table(name: str, *, plasterboard: bool = False) -> DamageTable:
    """Shipped damage table.

    Parameters
    ----------
    name : {"as2870", "bre251"}
        Name of the file in ``data/damage``.
    plasterboard : bool
        Whether its limits are raised for plasterboard.

    Raises
    ------
    InputError
        If there is no such table, or it has no allowance for plasterboard.

    Examples
    --------
    >>> from damagepred import damage
    >>> damage.load_table("as2870").limits
    (0.0001, 0.001, 0.005, 0.015)
    """
    if name not in TABLES:
        raise InputError(
            f"table = {name!r}: take {' or '.join(TABLES)}, or a file (*.toml) written like theirs."
            + nearest(name, TABLES)
        )
    table = read_table(data_file("damage", f"{name}.toml"))
    return table.with_plasterboard() if plasterboard else table


@checked
def read_table(path: str | Path) -> DamageTable:
    """Damage table from a file in the format of ``data/damage``.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    InputError
        If it is missing or is no such table.

    Examples
    --------
    >>> import damagepred
    >>> from damagepred.inputs.data_files import data_file
    >>> table = damagepred.damage.read_table(data_file("damage", "as2870.toml"))
    >>> table.name, table.limits
    ('AS 2870-2011 Table C1', (0.0001, 0.001, 0.005, 0.015))
    """
    content = read_toml(path)
    try:
        return _table(content)
    except KeyError as error:
        raise InputError(f"{path}: is no damage table, it lacks {error}; see data/damage/as2870.toml.") from None
    except (ValueError, TypeError, OverflowError) as error:
        raise InputError(f"{path}: is no damage table ({error}); see data/damage/as2870.toml.") from None


def _table(content: dict[str, Any]) -> DamageTable:
    categories = sorted(content["category"], key=lambda c: int(c["number"]))
    limits = [require_number("from", c["from"], 0.0, unit="m", open_low=True) for c in categories[1:]]
    if [c["number"] for c in categories] != list(range(len(categories))) or len(categories) < 2:
        raise ValueError("categories must be numbered 0, 1, ...")
    if any(a >= b for a, b in zip([0.0, *limits], limits)):
        raise ValueError("the limits must grow from category to category")
    names = [unicodedata.normalize("NFC", str(c["name"])) for c in categories]
    # letters of any script: the archive's attribute flag_meanings has the names, separated by blanks
    kinds = [
        re.sub(r"[LNM]", "a", "".join(unicodedata.category(c)[0] if c not in " _-" else c for c in n)) for n in names
    ]
    if bad := [name for name, kind in zip(names, kinds) if not re.fullmatch(r"a[a _-]{0,39}", kind)]:
        raise ValueError(f"category name {bad[0][:40]!r}: must be at most 40 letters, digits, spaces, '_' and '-'")
    if twice := [name for name in names if names.count(name) > 1]:
        raise ValueError(f"category name {twice[0]!r}: two categories have it")
    require_count("group.category", group := content["group"]["category"], 0)
    return DamageTable(
        name=check_title(content["name"]),
        source=str(content["source"]),
        confidence=str(content["confidence"]),
        category_names=tuple(names),
        limits=tuple(limits),
        group_category=int(require_number("group.category", group, 0, len(limits))),
        group_width=require_number("group.crack_width", content["group"]["crack_width"], 0.0, unit="m"),
        plasterboard_factor=require_number("plasterboard.factor", content["plasterboard"]["factor"], 0.0, open_low=True)
        if "plasterboard" in content
        else None,
    )
