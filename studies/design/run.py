"""The cheapest footing and joints of a house on clay, by site class.

    python studies/design/run.py --workers 2

goes on where it was stopped, writes the tables of the README, and draws the alternatives.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import xarray as xr

from damagepred import search_design
from damagepred.plotting import draw_design_search

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "validation"))

from judging import write_page  # noqa: E402

CLASSES = ("M", "H1")


def table(found: xr.Dataset) -> str:
    """Return alternatives and measures as tables of Markdown."""
    words = {0: "dearer or undecided", 1: "meets it", 2: "does not meet it"}
    lines = ["| footing and joints | cost | P(category 2 or worse) | walls | decision |", "|---|---|---|---|---|"]
    for name, one in found.groupby("alternative"):
        values = {key: float(one[key].squeeze()) for key in one.data_vars if "alternative" in one[key].dims}
        bounds = f"{values['probability']:.3f} ({values['probability_lower']:.3f} to {values['probability_upper']:.3f})"
        lines.append(
            f"| {name} | {values['cost']:.0f} | {bounds} | {values['samples']:.0f} | {words[int(values['decision'])]} |"
        )
    sure = "" if found.attrs["sure"] else ", though a cheaper one is undecided"
    lines += ["", f"Chosen: **{found.attrs['chosen'] or 'none'}**{sure}.", ""]
    lines += ["| measure | changes the probability by | costs |", "|---|---|---|"]
    for name, one in found.groupby("measure"):
        value, error, cost = (float(one[key].squeeze()) for key in ("value", "value_error", "extra_cost"))
        lines.append(f"| {name} | {value:.3f} (standard error {error:.3f}) | {cost:.0f} |")
    return "\n".join(lines)


def main() -> None:
    """Search on both classes, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=1)
    asked = parser.parse_args()
    parts = []
    for site in CLASSES:
        # both classes read the same walls
        found = search_design(
            HERE / f"class_{site.lower()}.toml",
            HERE / "results",
            workers=asked.workers,
            on_round=lambda size, count: print(f"{count} alternatives, {size} samples each", flush=True),
        )
        parts.append(f"### Class {site}\n\n{table(found)}")
        print(parts[-1], flush=True)
        figure, axes = plt.subplots(1, 2, figsize=(11.0, 4.2), layout="constrained")
        draw_design_search(found, axes)
        figure.savefig(HERE / f"class_{site.lower()}.png", dpi=100)
        plt.close(figure)
    write_page(HERE / "README.md", "\n\n".join(parts))


if __name__ == "__main__":
    main()
