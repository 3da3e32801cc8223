"""The page: tables from the data, and what they say of the defaults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pages
import pandas as pd
from diagrams import draw
from errors import FINE_ENOUGH, edge, load, orders, reference, with_errors, worst
from errors import MODELS as MODEL_REFERENCES
from quantities import QUANTITIES
from scenes import scenes

from damagepred.archive.files import write_whole
from damagepred.scene.accuracy import PRESETS

HERE = Path(__file__).resolve().parent


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
    """Return for each wall and quantity the fastest choice within the limit, and what the default has."""
    rows = []
    for (scene, quantity), own in lines.groupby(["scene", "quantity"], sort=False):
        own = own.dropna(subset=[error])
        default = own[own["axis"] == "default"]
        if not len(own) or not len(default) or own[error].max() < 1e-6:
            continue
        fine = own[own[error] <= limit]
        first = fine.sort_values("seconds").iloc[0] if len(fine) else None
        front = edge(own, error)
        rows.append(
            {"wall": scene, "quantity": QUANTITIES[quantity], "own error of the reference, %":
                percent(float(own[f"{error}_floor"].iloc[0])), "default, %": percent(float(default[error].iloc[0])),
             "default, s": float(default["seconds"].iloc[0]),
             "fastest within 1 %": "none" if first is None else f"{first['axis']}: {first['value']}",
             "its time, s": np.nan if first is None else float(first["seconds"]),
             "default on the edge": "yes" if on_edge(front, default.iloc[0], error) else "no"}
        )  # fmt: skip
    return pd.DataFrame(rows)


def on_edge(front: pd.DataFrame, line: pd.Series, error: str) -> bool:
    """Whether nothing is both faster by a fifth and more accurate by a tenth: below that, times are noise."""
    better = front[(front["seconds"] < 0.8 * line["seconds"]) & (front[error] < 0.9 * line[error] + 1e-9)]
    return not len(better)


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
    """Return what did not come to its end."""
    bad = rows[rows["status"] != "complete"]
    return bad[["scene", "axis", "value", "status"]].rename(columns={"scene": "wall", "status": "what became of it"})


def observed(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the orders, a row for each wall and refinement."""
    found = orders(rows)
    if not len(found):
        return found
    table = found.pivot_table(index=["scene", "refinement"], columns="quantity", values="order", sort=False)
    table = table.rename(columns=QUANTITIES).round(1).reset_index()
    return table.astype(object).where(table.notna(), "")


def references(rows: pd.DataFrame) -> pd.DataFrame:
    """Return which reference each wall has, and its own error (%)."""
    found = []
    for scene, own in rows.groupby("scene", sort=False):
        best = reference(own, MODEL_REFERENCES)
        if best is None:
            continue
        floors = {QUANTITIES[q]: percent(v) for q, v in best[0].floor.items()}
        found.append({"wall": scene, "finest model": f"{best[0].axis}: {best[0].value}",
                      "time, s": float(best[1]["seconds"]), **floors})  # fmt: skip
    return pd.DataFrame(found)


def write(data: Path, page: Path, pictures: Path, presets: Path) -> pd.DataFrame:
    """Make pictures, tables and the errors of the presets from the data; return all errors."""
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
        f"Measured on {pages.machine()}.", pages.markdown(walls),
        "### The default: error against the finest model, %",
        "In brackets the own error of the reference, where it is more than 1 %.",
        pages.markdown(at_default(lines, "model")),
        "### The default: error against the same equations solved closely, %",
        pages.markdown(at_default(lines, "solution")),
        "### References, and their own errors, %", pages.markdown(references(rows)),
        "### What reaches 1 % soonest", "*Against the same equations solved closely*",
        pages.markdown(cheapest(lines, "solution")), "*Against the finest model*",
        pages.markdown(cheapest(lines, "model")),
        "### Every choice: worst error over the quantities, and time over the default's",
        "*Solving: against the same equations solved closely*", pages.markdown(by_choice(lines, "solution")),
        "*Model: against the finest, of quantities that it knows to 1 %*", pages.markdown(by_choice(lines, "model")),
        "### Observed orders of convergence", pages.markdown(observed(rows)),
        "### What did not come to its end", pages.markdown(unfinished(rows)),
        "### Diagrams", *[f"![{n}]({n.replace(', ', '_').replace(' ', '_')}.png)" for n in names],
    ]  # fmt: skip
    pages.put_in(page, "\n\n".join(sections))
    write_presets(lines, presets)
    return lines


def write_presets(lines: pd.DataFrame, path: Path) -> None:
    """Write the errors of the presets against the finest model, for ``damagepred check``."""
    known, rows = scenes(), []
    for method in ("quasi_static", "explicit"):
        own = lines[(lines["axis"] == f"preset, {method}") & lines["model"].notna()]
        if method == "quasi_static":
            standard = lines[(lines["axis"] == "default") & lines["model"].notna()].assign(value="standard")
            own = pd.concat((own, standard))
        usual = own[own["value"] == "standard"].groupby("scene")["seconds"].first()
        for accuracy in PRESETS:
            for _, line in own[own["value"] == accuracy].iterrows():
                if line["scene"] not in usual:
                    continue
                scene = known[line["scene"]].scene
                rows.append(
                    {"accuracy": accuracy, "method": method, "wall": line["scene"].replace(",", ""),
                     "dpc": int(scene.dpc is not None), "opening": int(bool(scene.opening)),
                     "quantity": QUANTITIES[line["quantity"]], "error": f"{line['model']:.3g}",
                     "floor": f"{line['model_floor']:.3g}", "times": f"{line['seconds'] / usual[line['scene']]:.3g}"}
                )  # fmt: skip
    write_whole(path, lambda p: pd.DataFrame(rows).to_csv(p, index=False, lineterminator="\n"))
