"""Section of this benchmark on RESULTS.md; the errors of the presets, for ``damagepred check``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from damagepred.archive.files import write_whole
from damagepred.scene.accuracy import PRESETS
from studies.benchmarks.pages import markdown
from studies.benchmarks.work_precision.choices import PRESET
from studies.benchmarks.work_precision.errors import FINE_ENOUGH, load, orders, with_errors, worst
from studies.benchmarks.work_precision.quantities import QUANTITIES
from studies.benchmarks.work_precision.scenes import scenes

TITLE = "Error of a wall over computing time"


def headline(folder: Path) -> str:
    """Return on how many walls the default solves its equations to 1 %, in a sentence."""
    own = worst(with_errors(load(folder / "data.csv")).query("axis == 'default'"), "solution")
    dishing = own.set_index("scene")["seconds"]["dishing"]
    fine = (own["worst"] <= FINE_ENOUGH).sum()
    return f"the default solves its equations to 1 % on {fine} of {len(own)} walls, dishing in {dishing:.2g} s"


def text(folder: Path) -> str:
    """Return the accuracy of the default, the fastest choices within 1 %, presets, and orders."""
    rows = load(folder / "data.csv")
    lines = with_errors(rows)
    left = rows[rows["status"] != "complete"]
    ends = "".join(f"; {r.scene}, {r.axis} {r.value}: {r.status}" for r in left.itertuples())
    return "\n\n".join(
        (
            "*The default, error in %*: against the same equations solved closely / against the finest model "
            "(in brackets its error, where it is more than 1 %; - where there is none).",
            markdown(both(lines)),
            "*The fastest choice within 1 %* in all quantities whose reference is accurate to 1 %.",
            markdown(soonest(lines)),
            "*Presets*: worst error against the finest model, in % of quantities that are known to 1 %, x time "
            "over that of `standard`.",
            markdown(presets(lines)),
            "*Observed orders of convergence*, over walls and quantities whose last differences decrease.",
            markdown(observed(rows)),
            f"Paths that did not end regularly: {len(left)} of {len(rows)}{ends}.",
        )
    )


def percent(value: float) -> str:
    """Return a share in per cent, two digits."""
    if value != value:
        return ""
    return "0" if value < 5e-7 else f"{100 * value:.2g}"


def both(lines: pd.DataFrame) -> pd.DataFrame:
    """Return the errors of the default against both references in per cent, with floors, a row for each wall."""
    own = lines[lines["axis"] == "default"]

    def cells(error: str) -> list[str]:
        pairs = zip(own[error], own[f"{error}_floor"], strict=True)
        return [f"{percent(e)} ({percent(f)})" if e == e and f > FINE_ENOUGH else percent(e) for e, f in pairs]

    told = [f"{a or '-'} / {b or '-'}" if a or b else "" for a, b in zip(cells("solution"), cells("model"))]
    own = own.assign(cell=told, quantity=own["quantity"].map(QUANTITIES))
    found = own.pivot_table(index=["scene", "seconds"], columns="quantity", values="cell", aggfunc="first", sort=False)
    return found.rename_axis(index=["wall", "time, s"], columns=None).reset_index().fillna("")


def soonest(lines: pd.DataFrame) -> pd.DataFrame:
    """Return, wall by wall, the accuracy of the default and the fastest choice within 1 % of each reference."""
    few = lines["axis"].isin(("increments", "explicit increments")) & lines["value"].isin(("4", "8"))
    lines = lines[~(few | lines["axis"].str.startswith("in time"))]  # as many points of the path as the default
    found = []
    for error, name in (("solution", "same equations"), ("model", "finest model")):
        known = lines.dropna(subset=[error])
        varies = known.groupby(["scene", "quantity"])[error].transform("max") >= 1e-6
        default, worse = known[varies & (known["axis"] == "default")], worst(lines, error)
        rows = []
        for scene, own in default.groupby("scene", sort=False):
            told = own[own[f"{error}_floor"] <= FINE_ENOUGH]
            fine = worse[(worse["scene"] == scene) & (worse["worst"] <= FINE_ENOUGH)].sort_values("seconds")
            best = fine.iloc[0] if len(fine) else {"axis": "", "value": "none", "seconds": np.nan}
            rows.append(
                {
                    "wall": scene,
                    "default, s": own["seconds"].iloc[0],
                    f"default within 1 % ({name})": f"{(told[error] <= FINE_ENOUGH).sum()} of {len(told)}",
                    f"fastest ({name})": f"{best['axis']}: {best['value']}".removeprefix(": "),
                    f"its time, s ({name})": best["seconds"],
                }
            )
        found.append(pd.DataFrame(rows).set_index(["wall", "default, s"]))
    return pd.concat(found, axis=1).reset_index()


def presets(lines: pd.DataFrame) -> pd.DataFrame:
    """Return the worst error and the time of each preset, wall by wall."""
    told = preset_errors(lines)
    told = told.assign(**{name: told[name].astype(float) for name in ("error", "floor", "times")})
    told = told[told["floor"] <= FINE_ENOUGH]
    rows = []
    for (method, accuracy), own in told.groupby(["method", "accuracy"], sort=False):
        cells = {
            wall: f"{percent(part['error'].max())} x{part['times'].iloc[0]:.2g}" for wall, part in own.groupby("wall")
        }
        rows.append({"preset": f"{accuracy}, {method.replace('quasi_', 'quasi-')}", **cells})
    return pd.DataFrame(rows).fillna("")


def observed(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the median of the observed orders of each refinement, and their range."""
    found = orders(rows)
    each = found["order"].round(1).groupby(found["refinement"], sort=False)
    columns = {"median": "median", "from": "min", "to": "max", "found in": "size"}
    return each.agg([*columns.values()]).set_axis([*columns], axis=1).reset_index()


TOLD = 0.25
"""Error of a reference up to which it is used for a preset."""
STATICALLY_DETERMINATE = ("base_reaction",)
"""Quantities that follow from the weights alone: they do not depend on a preset."""


def preset_errors(lines: pd.DataFrame) -> pd.DataFrame:
    """Return the errors of the presets against the finest model, and their times over those of the default.

    Left out are quantities on which the finest models do not agree to ``TOLD``, quantities that a wall does not have
    (no crack, and so no width and no category), and those that follow from the weights alone.
    """
    known, rows = scenes(), []
    for method in ("quasi_static", "explicit"):
        told = lines[lines["model"].notna() & (lines["model_floor"] <= TOLD)]
        told = told[~told["quantity"].isin(STATICALLY_DETERMINATE)]
        own = told[told["axis"] == "preset, explicit"]
        if method == "quasi_static":
            parts = [told[(told["axis"] == a) & (told["value"] == v)].assign(value=p) for p, (a, v) in PRESET.items()]
            own = pd.concat(parts)
        usual = own[own["value"] == "standard"].groupby("scene")["seconds"].first()
        for accuracy in PRESETS:
            for _, line in own[own["value"] == accuracy].iterrows():
                if line["scene"] not in usual:
                    continue
                scene = known[line["scene"]]
                rows.append(
                    {
                        "accuracy": accuracy,
                        "method": method,
                        "wall": line["scene"].replace(",", ""),
                        "dpc": int(scene.dpc is not None),
                        "opening": int(bool(scene.opening)),
                        "quantity": QUANTITIES[line["quantity"]],
                        "error": f"{line['model']:.3g}",
                        "floor": f"{line['model_floor']:.3g}",
                        "times": f"{line['seconds'] / usual[line['scene']]:.3g}",
                    }
                )
    return pd.DataFrame(rows)


def write_presets(data: Path, file: Path) -> None:
    """Write the errors of the presets."""
    table = preset_errors(with_errors(load(data)))
    write_whole(file, lambda path: table.to_csv(path, index=False, lineterminator="\n"))
