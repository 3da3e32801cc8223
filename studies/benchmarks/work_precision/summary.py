"""Section of this benchmark on RESULTS.md; the errors of the presets, for ``damagepred check``."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from damagepred.archive.files import write_whole
from damagepred.scene.accuracy import PRESETS
from studies.benchmarks.work_precision.choices import PRESET, scenes
from studies.benchmarks.work_precision.errors import FINE_ENOUGH, load, with_errors, worst
from studies.benchmarks.work_precision.quantities import QUANTITIES
from studies.pages import markdown

TITLE = "Error of a wall over computing time"
WORDS = {name: quantity.words for name, quantity in QUANTITIES.items()}


def headline(folder: Path) -> str:
    """Return on how many walls the default solves its equations to 1 %, in a sentence."""
    own = worst(with_errors(load(folder / "data.csv")).query("axis == 'default'"), "solution")
    dishing = own.set_index("scene")["seconds"]["dishing"]
    fine = (own["worst"] <= FINE_ENOUGH).sum()
    return f"the default solves its equations to 1 % on {fine} of {len(own)} walls, dishing in {dishing:.2g} s"


def text(folder: Path) -> str:
    """Accuracy of the default, and of the presets."""
    rows = load(folder / "data.csv")
    lines = with_errors(rows)
    left = rows[rows["status"] != "complete"]
    ends = "".join(f"; {r.scene}, {r.axis} {r.value}: {r.status}" for r in left.itertuples())
    return "\n\n".join(
        (
            "*The default, error in %*: against the same equations solved closely / against the finest model "
            "(in brackets its error, where it is more than 1 %; - where there is none).",
            markdown(both(lines)),
            "*Presets*: worst error against the finest model, in % of quantities that are known to 1 %, x time "
            "over that of `standard`.",
            markdown(presets(lines)),
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
    own = own.assign(cell=told, quantity=own["quantity"].map(WORDS))
    found = own.pivot_table(index=["scene", "seconds"], columns="quantity", values="cell", aggfunc="first", sort=False)
    return found.rename_axis(index=["wall", "time, s"], columns=None).reset_index().fillna("")


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


TOLD = 0.25
"""Error of a reference up to which it is used for a preset."""


def preset_errors(lines: pd.DataFrame) -> pd.DataFrame:
    """Return the errors of the presets against the finest model, and their times over those of the default.

    Left out are quantities on which the finest models do not agree to ``TOLD``, quantities that a wall does not have
    (no crack, and so no width and no category), and the base reaction, which follows from the weights alone.
    """
    told = lines[lines["model"].notna() & (lines["model_floor"] <= TOLD) & (lines["quantity"] != "base_reaction")]
    names = {**{which: ("quasi_static", name) for name, which in PRESET.items()}}
    names |= {("preset, explicit", name): ("explicit", name) for name in PRESETS}
    known, found = scenes(), []
    for which, (method, accuracy) in names.items():
        own = told[(told["axis"] == which[0]) & (told["value"] == which[1])]
        found.append(own.assign(accuracy=accuracy, method=method))
    rows = pd.concat(found)
    usual = rows[rows["accuracy"] == "standard"].groupby(["method", "scene"])["seconds"].first().rename("usual")
    rows = rows.merge(usual, on=["method", "scene"])
    walls = rows["scene"].map(known)
    return pd.DataFrame(
        {
            "accuracy": rows["accuracy"],
            "method": rows["method"],
            "wall": rows["scene"].str.replace(",", ""),
            "dpc": [int(wall.dpc is not None) for wall in walls],
            "opening": [int(bool(wall.opening)) for wall in walls],
            "quantity": rows["quantity"].map(WORDS),
            "error": rows["model"].map("{:.3g}".format),
            "floor": rows["model_floor"].map("{:.3g}".format),
            "times": (rows["seconds"] / rows["usual"]).map("{:.3g}".format),
        }
    )


def write_presets(data: Path, file: Path) -> None:
    """Write the errors of the presets."""
    table = preset_errors(with_errors(load(data)))
    write_whole(file, lambda path: table.to_csv(path, index=False, lineterminator="\n"))
