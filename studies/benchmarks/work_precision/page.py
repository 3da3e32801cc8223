"""The page: tables from the data, and the errors of the defaults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pages
import pandas as pd
from choices import PRESET
from diagrams import draw
from errors import FINE_ENOUGH, edge, load, orders, reference, with_errors, worst
from errors import MODELS as MODEL_REFERENCES
from quantities import QUANTITIES
from scenes import scenes

from damagepred.archive.files import write_whole
from damagepred.scene.accuracy import PRESETS

HERE = Path(__file__).resolve().parent
NO_ERROR = 1e-4
"""Share of a value below which errors count as zero."""


def percent(value: float) -> str:
    """Return a share in per cent, two digits."""
    if value != value:
        return ""
    return "0" if value < 5e-7 else f"{100 * value:.2g}"


def at_default(lines: pd.DataFrame, error: str, axis: str = "default", value: str | None = None) -> pd.DataFrame:
    """Return the errors of one choice, a row for each wall, a column for each quantity, in per cent with floors."""
    own = lines[lines["axis"] == axis]
    if value is not None:
        own = own[own["value"] == value]
    rows = []
    for scene, part in own.groupby("scene", sort=False):
        row: dict[str, object] = {"wall": scene, "time, s": float(part["seconds"].iloc[0])}
        for quantity, name in QUANTITIES.items():
            cell = part[part["quantity"] == quantity]
            if not len(cell):
                continue
            found, floor = float(cell[error].iloc[0]), float(cell[f"{error}_floor"].iloc[0])
            text = percent(found)
            row[name] = f"{text} ({percent(floor)})" if text and floor > FINE_ENOUGH else text
        rows.append(row)
    return pd.DataFrame(rows).fillna("")


def cheapest(lines: pd.DataFrame, error: str, limit: float = FINE_ENOUGH) -> pd.DataFrame:
    """Return for each wall and quantity the fastest choice within the limit, and the error of the default."""
    rows = []
    for (scene, quantity), own in lines[comparable(lines)].groupby(["scene", "quantity"], sort=False):
        own = own.dropna(subset=[error])
        default = own[own["axis"] == "default"]
        if not len(own) or not len(default) or own[error].max() < 1e-6:
            continue
        fine = own[own[error] <= limit].sort_values("seconds")
        rows.append(
            {
                "wall": scene,
                "quantity": QUANTITIES[quantity],
                "floor": float(own[f"{error}_floor"].iloc[0]),
                "error": float(default[error].iloc[0]),
                "default, s": float(default["seconds"].iloc[0]),
                "fastest within 1 %": f"{fine['axis'].iloc[0]}: {fine['value'].iloc[0]}" if len(fine) else "none",
                "its time, s": float(fine["seconds"].iloc[0]) if len(fine) else np.nan,
                "default on the edge": "yes" if on_edge(edge(own, error), default.iloc[0], error) else "no",
            }
        )
    return pd.DataFrame(rows)


def on_edge(front: pd.DataFrame, line: pd.Series, error: str) -> bool:
    """Return whether no choice is faster by a quarter, beyond the noise of times, and as accurate or better.

    Errors below 0.01 % count as zero.
    """
    better = front[(front["seconds"] < 0.75 * line["seconds"]) & (front[error] <= max(line[error], NO_ERROR))]
    return not len(better)


def summary(lines: pd.DataFrame, error: str) -> pd.DataFrame:
    """Return, wall by wall, the accuracy of the default and the fastest choice with all quantities within 1 %."""
    table, worse = cheapest(lines, error), worst(lines[comparable(lines)], error)
    rows = []
    for scene, own in table.groupby("wall", sort=False):
        told = own[own["floor"] <= FINE_ENOUGH]
        beyond = told[told["error"] > FINE_ENOUGH]
        fine = worse[(worse["scene"] == scene) & (worse["worst"] <= FINE_ENOUGH)].sort_values("seconds")
        untold = own.loc[own["floor"] > FINE_ENOUGH, "quantity"]
        rows.append(
            {
                "wall": scene,
                "default, s": float(own["default, s"].iloc[0]),
                "within 1 %": f"{len(told) - len(beyond)} of {len(told)}",
                "beyond": ", ".join(f"{r['quantity']} {percent(r['error'])} %" for _, r in beyond.iterrows()),
                "default on the edge": f"{int((told['default on the edge'] == 'yes').sum())} of {len(told)}",
                "fastest with all within 1 %": f"{fine['axis'].iloc[0]}: {fine['value'].iloc[0]}"
                if len(fine)
                else "none",
                "its time, s": float(fine["seconds"].iloc[0]) if len(fine) else np.nan,
                "not known to 1 %": ", ".join(untold),
            }
        )
    return pd.DataFrame(rows)


def comparable(lines: pd.DataFrame) -> pd.Series:
    """Return which lines have at least as many points of the path as the default."""
    few = lines["axis"].isin(("increments", "explicit increments")) & lines["value"].isin(("4", "8"))
    return ~(few | lines["axis"].str.startswith("in time"))


def by_choice(lines: pd.DataFrame, error: str) -> pd.DataFrame:
    """Return for each choice its worst error (%) and its time over the default's, wall by wall."""
    table = worst(lines, error)
    default = table[table["axis"] == "default"].set_index("scene")["seconds"]
    names = list(dict.fromkeys(table["scene"]))
    rows = []
    for (axis, value), own in table.groupby(["axis", "value"], sort=False):
        row: dict[str, object] = {"choice": f"{axis}: {value}"}
        for name in names:
            cell = own[own["scene"] == name]
            row[name] = ""
            if len(cell):
                times = float(cell["seconds"].iloc[0]) / float(default[name])
                row[name] = f"{percent(float(cell['worst'].iloc[0]))} % x{times:.2g}"
        rows.append(row)
    return pd.DataFrame(rows)


def unfinished(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the paths that did not end regularly."""
    bad = rows[rows["status"] != "complete"]
    return bad[["scene", "axis", "value", "status"]].rename(columns={"scene": "wall", "status": "end"})


def observed(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the orders, a row for each wall and refinement."""
    found = orders(rows)
    if not len(found):
        return found
    table = found.pivot_table(index=["scene", "refinement"], columns="quantity", values="order", sort=False)
    table = table.rename(columns=QUANTITIES).round(1).reset_index()
    return table.astype(object).where(table.notna(), "")


def references(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the reference of each wall and its error (%)."""
    found = []
    for scene, own in rows.groupby("scene", sort=False):
        best = reference(own, MODEL_REFERENCES)
        if best is None:
            continue
        floors = {QUANTITIES[q]: percent(v) for q, v in best[0].floor.items()}
        found.append(
            {
                "wall": scene,
                "finest model": f"{best[0].axis}: {best[0].value}",
                "time, s": float(best[1]["seconds"]),
                **floors,
            }
        )
    return pd.DataFrame(found)


def write(data: Path, page: Path, pictures: Path, presets: Path) -> pd.DataFrame:
    """Write pictures, tables and the errors of the presets from the data; return all errors."""
    rows = load(data)
    lines = with_errors(rows)
    known = scenes()
    names = [name for name in known if name in set(lines["scene"])]
    for name in names:
        draw(
            name,
            known[name].what,
            lines[lines["scene"] == name],
            pictures / f"{name.replace(', ', '_').replace(' ', '_')}.png",
        )
    walls = pd.DataFrame(
        [{"wall": n, "what": known[n].what, "blocks": int(rows[rows["scene"] == n]["blocks"].max())} for n in names]
    )
    sections = [
        f"Measured on {pages.machine()}.",
        pages.markdown(walls),
        "### The default: error against the finest model, %",
        "In brackets the error of the reference, where it is more than 1 %.",
        pages.markdown(at_default(lines, "model")),
        "### The default: error against the same equations solved closely, %",
        pages.markdown(at_default(lines, "solution")),
        "### References and their errors, %",
        pages.markdown(references(rows)),
        "### Accuracy of the default, and the fastest choice within 1 %",
        "Only choices with the same number of points of the path. On the edge: on the Pareto front of time and error. "
        "By quantity: [edges_solution.csv](edges_solution.csv), [edges_model.csv](edges_model.csv).",
        "*Against the same equations solved closely*",
        pages.markdown(summary(lines, "solution")),
        "*Against the finest model*",
        pages.markdown(summary(lines, "model")),
        "### Every choice: worst error over the quantities, and time over the default's",
        "*Solving: against the same equations solved closely*",
        pages.markdown(by_choice(lines, "solution")),
        "*Model: against the finest, of quantities that it knows to 1 %*",
        pages.markdown(by_choice(lines, "model")),
        "### Observed orders of convergence",
        pages.markdown(observed(rows)),
        "### Paths that did not end regularly",
        pages.markdown(unfinished(rows)),
        "### Diagrams",
        *[f"![{n}]({n.replace(', ', '_').replace(' ', '_')}.png)" for n in names],
    ]
    pages.put_in(page, "\n\n".join(sections))
    for error in ("solution", "model"):
        table = cheapest(lines, error).round({"floor": 6, "error": 6})
        write_whole(
            page.parent / f"edges_{error}.csv", lambda p, t=table: t.to_csv(p, index=False, lineterminator="\n")
        )
    # for ``damagepred check``
    write_whole(presets, lambda p: preset_errors(lines).to_csv(p, index=False, lineterminator="\n"))
    return lines


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
                scene = known[line["scene"]].scene
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
