"""Errors of every choice against a reference of known error."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from damagepred.arrays import FloatArray
from studies.benchmarks.work_precision.choices import FINEST, SOLID, choices
from studies.benchmarks.work_precision.quantities import QUANTITIES, SHARES

SOLUTIONS = [(SOLID, "320 increments"), (SOLID, "160 increments")]
MODELS = [
    (FINEST, "30 mm, Lobatto 7"),
    (FINEST, "40 mm, Lobatto 7"),
    (FINEST, "40 mm, Lobatto 5"),
    ("zones", "40 mm"),
    ("zones", "60 mm, Lobatto 5"),
    ("zones", "60 mm"),
    ("zones", "default size, Lobatto 5"),
    ("zones", "default size"),
]
"""References, the best first; the next two give the error of the first available one."""
FINE_ENOUGH = 0.01


def load(path: Path) -> pd.DataFrame:
    """Return the data, walls in the order of the choices."""
    rows = pd.read_csv(path, keep_default_na=True)
    rank = {(c.axis, c.value): n for n, c in enumerate(choices())}
    rows["value"] = rows["value"].astype(str)
    rows["rank"] = [rank.get((a, v), len(rank)) for a, v in zip(rows["axis"], rows["value"])]
    return rows.sort_values(["rank"], kind="stable").reset_index(drop=True)


def values_of(row: pd.Series, quantity: str) -> FloatArray:
    """Return a quantity of a path at each of ``SHARES``."""
    return np.array([row[f"{quantity}@{share:g}"] for share in SHARES], dtype=np.float64)


def difference(one: pd.Series, other: pd.Series, quantity: str) -> float:
    """Return the error of a path against a reference, as a share of its largest value; NaN where neither has it.

    Neither has a quantity of which both stay below its smallest value: a wall without a crack has no crack width. If
    only one of them has a crack, the difference is its width.
    """
    a, b, least = values_of(one, quantity), values_of(other, quantity), QUANTITIES[quantity].least
    if quantity == "first_crack" and np.isnan(a[-1]) != np.isnan(b[-1]):
        return 1.0
    both = np.isfinite(a) & np.isfinite(b)
    if not both.any() or max(np.abs(a[both]).max(), np.abs(b[both]).max()) < least:
        return float("nan")
    return float(np.abs(a - b)[both].max()) / max(float(np.abs(b[both]).max()), least)


def reference(rows: pd.DataFrame, preferred: list[tuple[str, str]]) -> tuple[pd.Series, dict[str, float]] | None:
    """Return the best reference of a wall, and its error by quantity; None if there are not two.

    The error is the largest difference to the next two coarser references; 0 where no reference has the quantity.
    """
    known = {(r["axis"], r["value"]): r for _, r in rows.iterrows()}
    have = [known[key] for key in preferred if key in known]
    if len(have) < 2:
        return None
    found = {q: np.array([difference(other, have[0], q) for other in have[1:3]]) for q in QUANTITIES}
    return have[0], {q: float(np.nanmax(each)) if np.isfinite(each).any() else 0.0 for q, each in found.items()}


def with_errors(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a line for each wall, choice and quantity: error against both references, and the references' own.

    Columns are scene, axis, value, seconds, quantity, solution, solution_floor, model, model_floor: ``solution`` is
    against the same equations solved as closely as can be, ``model`` against the finest model of the wall.
    """
    lines, changes = [], {(c.axis, c.value) for c in choices() if c.model}
    for _, own in rows[rows["status"] == "complete"].groupby("scene", sort=False):
        found = {"solution": reference(own, SOLUTIONS), "model": reference(own, MODELS)}
        for _, row in own.iterrows():
            for quantity in QUANTITIES:
                line = {**row[["scene", "axis", "value", "seconds"]], "quantity": quantity}
                for name, best in found.items():
                    error = floor = np.nan
                    if best is not None and not (name == "solution" and (row["axis"], row["value"]) in changes):
                        error = difference(row, best[0], quantity)
                        floor = best[1][quantity] if np.isfinite(error) else np.nan
                    line |= {name: error, f"{name}_floor": floor}
                lines.append(line)
    return pd.DataFrame(lines)


def worst(lines: pd.DataFrame, error: str, limit: float = FINE_ENOUGH) -> pd.DataFrame:
    """Return for each wall and choice its largest error over the quantities whose reference is accurate enough."""
    fair = lines[(lines[f"{error}_floor"] <= limit) & lines[error].notna()]
    grouped = fair.groupby(["scene", "axis", "value"], sort=False)
    return grouped.agg(seconds=("seconds", "first"), worst=(error, "max")).reset_index()


def print_errors(data: Path) -> None:
    """Print the errors of a file of results, by wall and way, against the finest model and the finest solution."""
    lines = with_errors(load(data))
    for against in ("model", "solution"):
        known = lines.dropna(subset=[against])
        table = known.pivot_table(index=["scene", "axis", "value"], columns="quantity", values=against, sort=False)
        print(f"relative error against the finest {against}\n{table.to_string(float_format='{:.4f}'.format)}\n")


if __name__ == "__main__":
    print_errors(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).with_name("data.csv"))
