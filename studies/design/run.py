"""The cheapest footing and joints of a house on clay, by site class, and those of the least expected cost.

    python studies/design/run.py [--workers 2] [--price]

goes on where it was stopped, writes the tables of the README, and draws the alternatives. All targets read the same
walls.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

from damagepred import search_design
from damagepred.analyses.design_search import price_of_search
from damagepred.plotting import draw_design_search

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "validation"))

from studies.pages import put_in  # noqa: E402

CLASSES = ("M", "H1")
ASKED = "category = 2\nprobability = 0.05"
MOST = "most = 128"
REPAIRS = "repair_costs = [200, 1500, 6000, 20000]\ntolerance = 100"
"""Assumed costs of repair of categories 1 to 4, for the whole wall."""
TARGETS = {"": (ASKED, MOST), "_costs": (REPAIRS, "most = 128")}
"""Targets by the ending of their pictures. Expected costs are read from the walls that the probabilities need."""
HEADS = {"probability": "P(category 2 or worse)", "expected_cost": "expected cost with repairs"}
DECISIONS = {
    "probability": ("dearer or undecided", "meets it", "does not meet it"),
    "expected_cost": ("undecided", "least", "dearer"),
}
SHOWN = 6
"""Cheapest alternatives of the tables."""


def choices(site: str, target: tuple[str, str]) -> str:
    """Return the file of the choices for a site class and a target, for the folder of the results."""
    text = (HERE / "choices.toml").read_text(encoding="utf-8")
    changes = zip((ASKED, MOST), target)
    for old, new in (("house.toml", "../house.toml"), ('at = "H1"', f'at = "{site}"'), *changes):
        before, after = text.split(old)  # fails unless it stands there once
        text = before + new + after
    return text


def table(found: xr.Dataset) -> str:
    """Return alternatives and measures as tables of Markdown."""
    quantity = str(found.attrs["quantity"])
    by_cost = quantity == "expected_cost"
    digits = ".0f" if by_cost else ".3f"
    lines = [f"| footing and joints | cost | {HEADS[quantity]} | walls | decision |", "|---|---|---|---|---|"]
    cheapest = found["alternative"].values[np.argsort(found["cost"].values)[:SHOWN]]
    for name, one in found.sel(alternative=np.isin(found["alternative"], cheapest)).groupby("alternative"):
        values = {key: float(one[key].squeeze()) for key in one.data_vars if "alternative" in one[key].dims}
        middle, low, high = (f"{values[quantity + end]:{digits}}" for end in ("", "_lower", "_upper"))
        decision = DECISIONS[quantity][int(values["decision"])]
        lines.append(
            f"| {name} | {values['cost']:.0f} | {middle} ({low} to {high}) | {values['samples']:.0f} | {decision} |"
        )
    if by_cost:
        sure = f"; no other costs less by more than {found.attrs['regret']:.0f}"
    else:
        sure = "" if found.attrs["sure"] else ", though a cheaper one is undecided"
    lines += ["", f"Chosen: **{found.attrs['chosen'] or 'none'}**{sure}.", ""]
    lines += [f"| measure | changes the {'cost of repair' if by_cost else 'probability'} by | costs |", "|---|---|---|"]
    for name, one in found.groupby("measure"):
        value, error, cost = (float(one[key].squeeze()) for key in ("value", "value_error", "extra_cost"))
        value = round(value, 0 if by_cost else 3) + 0.0  # no minus before a zero
        lines.append(f"| {name} | {value:+{digits}} (standard error {error:{digits}}) | {cost:.0f} |")
    return "\n".join(lines)


def main() -> None:
    """Search on both classes for both targets, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--price", action="store_true", help="print the price alone")
    asked = parser.parse_args()
    results = HERE / "results"
    results.mkdir(exist_ok=True)
    print(price_of_search(HERE / "choices.toml", asked.workers), flush=True)
    if asked.price:
        return
    found = {}
    for ending, target in TARGETS.items():
        for site in CLASSES:
            file = results / f"class_{site.lower()}{ending}.toml"
            file.write_text(choices(site, target), encoding="utf-8")
            found[ending, site] = search_design(
                file,
                results,
                workers=asked.workers,
                on_round=lambda size, count: print(f"{count} alternatives, {size} samples each", flush=True),
            )
    parts = []
    for (ending, site), one in found.items():
        parts.append(f"### Class {site}, {'expected cost' if ending else 'probability'}\n\n{table(one)}")
        print(parts[-1], flush=True)
        figure, axes = plt.subplots(1, 2, figsize=(11.0, 4.2), layout="constrained")
        draw_design_search(one, axes)
        figure.savefig(HERE / f"class_{site.lower()}{ending}.png", dpi=100)
        plt.close(figure)
    put_in(HERE / "README.md", "\n\n".join(parts))


if __name__ == "__main__":
    main()
