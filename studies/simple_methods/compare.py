"""Tables of the comparison: the categories at the limits of AS 2870, and the movement at which each was reached."""

from __future__ import annotations

import numpy as np
import pandas as pd
from walls import Case

from damagepred.damage import construction_limits

WALL = list(Case._fields)


def agreement(paths: pd.DataFrame) -> pd.DataFrame:
    """Category of the model and of the deep beam for each wall and limit that the model reached."""
    rows = []
    for name, limit in construction_limits().items():
        allowed = np.array([limit.value(length, height) for length, height in zip(paths["length"], paths["height"])])
        at = paths[np.isclose(paths["deflection_ratio"], allowed, rtol=1e-4) & (paths["category"] >= 0)]
        part = at[[*WALL, "deflection_ratio", "category", "perpend_category"]].copy()
        part["limit"], part["simple"] = name, at["beam_category"]
        part["difference"] = part["simple"] - part["category"]
        rows.append(part)
    return pd.concat(rows, ignore_index=True)


def capacities(paths: pd.DataFrame) -> pd.DataFrame:
    """Deflection ratio at which the model and the deep beam first reach each category; NaN if not reached."""
    columns = {"model": "category", "perpends": "perpend_category", "beam": "beam_category"}
    rows = []
    for wall, path in paths.groupby(WALL, sort=False):
        followed = path["deflection_ratio"][path["category"] >= 0].max()
        for category in (1, 2, 3, 4):
            row = dict(zip(WALL, wall)) | {"reaches": category, "followed_to": followed}
            for name, column in columns.items():
                there = path["deflection_ratio"][path[column] >= category]
                row[name] = there.min() if len(there) else np.nan
            rows.append(row)
    return pd.DataFrame(rows)


def summary(levels: pd.DataFrame) -> list[str]:
    """Table of the shares of lower, equal and higher categories than the model's, by all cracks and by perpends."""
    three = "too safe, the same, too severe"
    lines = [
        f"| base | movement | cases | by all cracks: {three} | by perpends: {three} |",
        "|---|---|---|---|---|",
    ]
    for dpc, base in ((False, "no dpc"), (True, "dpc")):
        for movement in ("dishing", "doming"):
            own = levels[(levels["dpc"] == dpc) & (levels["movement"] == movement)]
            shares = [
                ", ".join(f"{part.mean():.0%}" for part in (off < 0, off == 0, off > 0))
                for off in (own["difference"], own["simple"] - own["perpend_category"])
            ]
            lines.append(f"| {base} | {movement} | {len(own)} | {' | '.join(shares)} |")
    return lines


def cracked(reached: pd.DataFrame, category: int = 2) -> list[str]:
    """Return the README's table of walls that reach a category before the end of the movement, by the model."""
    whole = reached[
        (reached["reaches"] == category) & (reached["followed_to"] > (1 - 1e-4) * reached["followed_to"].max())
    ]
    lines = [
        "| base | movement | walls | crack of 1 mm in any joint | in perpends | the first of these at | deep beam at |",
        "|---|---|---|---|---|---|---|",
    ]
    for dpc, base in ((False, "no dpc"), (True, "dpc")):
        for movement in ("dishing", "doming"):
            own = whole[(whole["dpc"] == dpc) & (whole["movement"] == movement)]
            parted = own["perpends"].dropna()
            first = f"1/{1 / parted.min():.0f}" if len(parted) else ""
            beam = f"1/{1 / own['beam'].min():.0f} to 1/{1 / own['beam'].max():.0f}"
            counts = f"{len(own)} | {own['model'].notna().sum()} | {len(parted)}"
            lines.append(f"| {base} | {movement} | {counts} | {first} | {beam} |")
    return lines
