"""Probability of damage to a house wall on reactive clay: class of site by class of site, footing by footing.

    python studies/soil_movement/run.py [--samples 32] [--workers 2] [--footings veneer full_masonry]
        [--kinds doming dishing] [--largest 150] [--output studies/soil_movement/results]

Every footing and direction of movement is a separate study, with the same sampled walls, in a folder that damagepred
reads (status, replay, plot). Its paths run through the mounds of growing y_s up to the largest, and are read at each
y_s in between. Four times as many walls go to 60 mm, for closer bounds on small probabilities. The same call resumes an
interrupted one; a larger --samples adds walls. Tables and curves are made from all studies in the output folder; the
published ones go into the page.
"""

from __future__ import annotations

import argparse
import itertools
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
import xarray as xr
from stripes import by_thirds, read_at, shares

from damagepred import fit_fragility, open_study, solve
from damagepred.archive.files import write_whole
from damagepred.campaign.replay import replay
from damagepred.campaign.settings import StudySettings
from damagepred.plotting.colours import CATEGORY_COLOURS
from damagepred.plotting.fragility import draw_fragility
from damagepred.plotting.sheet import DPI, new_figure, set_title
from damagepred.plotting.wall import draw_wall
from damagepred.scene.site import site_class, standard_footing
from damagepred.study import Study
from studies.pages import markdown, put_in

HERE = Path(__file__).resolve().parent
FOOTINGS = {"light": "clad_frame", "veneer": "masonry_veneer", "full_masonry": "full_masonry"}
KINDS = ("doming", "dishing")
MOVEMENTS = (20, 40, 60, 75, 85, 100, 125, 150)
"""Surface movements y_s (mm) of the tables: the limits of the classes, and some beyond."""
LARGEST = 150.0
"""Largest y_s (mm) of the paths."""
CLOSE = 60.0
"""Largest y_s (mm) of the paths of four times as many walls."""
STEP = 5.0
"""Increments of the movement (mm)."""
STIFFNESS = {"doming": "soil.shrinking_stiffness", "dishing": "soil.swelling_stiffness"}
VALUES = {"dishing": (1e6, 2e6, 4e6, 8e6), "doming": (1.25e6, 2.5e6, 5e6, 10e6)}
"""Stiffness of the soil (Pa/m), around the defaults of swelling and of shrinking soil."""
PICTURE = ("veneer", "dishing", 100.0)
"""Footing, way of movement and y_s (mm) of the wall that is drawn."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=32, help="walls to sample, a power of two at best")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--footings", nargs="+", choices=list(FOOTINGS), default=["veneer", "full_masonry"])
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--largest", type=float, default=LARGEST, help="largest y_s (mm) of the paths")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder for archives, tables, pictures")
    options = parser.parse_args()
    runs = [(options.largest, options.samples)]
    if options.largest > CLOSE:
        runs.append((CLOSE, 4 * options.samples))
    for (largest, samples), footing, kind in itertools.product(runs, options.footings, options.kinds):
        study = Study(settings(footing, kind, largest))
        folder = place(options.output, footing, kind, largest)
        summary = study.run(folder, samples, workers=options.workers)
        print(f"{folder.name}: {summary.done} walls, {summary.failed} failed, {summary.seconds:.0f} s", flush=True)
        if summary.interrupted:
            return 130
    shared, failed = report(options.output)
    on_soil, of_bricks = by_stiffness(), by_bricks()
    if options.output == HERE / "results":
        put_in(HERE / "README.md", markdown(in_percent(shared)), "<!-- shares -->", "<!-- end of shares -->")
        put_in(HERE / "README.md", markdown(on_soil), "<!-- stiffness -->", "<!-- end of stiffness -->")
        put_in(HERE / "README.md", markdown(of_bricks), "<!-- bricks -->", "<!-- end of bricks -->")
        for name in ("fragility.png", "wall.png"):
            shutil.copy(options.output / name, HERE / name)
    return 3 * failed


def in_percent(shared: pd.DataFrame) -> pd.DataFrame:
    """Table of the page: one row per footing, movement and category that a wall reached, one column per y_s."""

    def cell(row: pd.Series) -> str:
        low, share, high = (100 * row[name] for name in ("lower", "share", "upper"))
        return f"{share:.0f} % ({low:.0f}-{high:.0f})" if row["reached"] else f"0 (< {high:.0f})"

    heading = shared["site class"] + ": " + shared["y_s (mm)"].astype(str) + " mm"
    rows = ["footing", "movement", "category"]
    table = shared.assign(heading=heading, cell=shared.apply(cell, axis=1))
    table = table[table.groupby(rows)["reached"].transform("max") > 0]
    return table.pivot(index=rows, columns="heading", values="cell")[heading.unique()].reset_index()


def by_stiffness(millimetres: float = 100.0) -> pd.DataFrame:
    """Deflection and damage of the mean wall on softer and stiffer soil."""
    rows = []
    for kind, values in VALUES.items():
        scene = settings("veneer", kind, millimetres).scene
        movement = replace(scene.movement, increments=5)
        for value in values:
            soil = replace(scene.soil, swelling_stiffness=value, shrinking_stiffness=value)
            wall = solve(replace(scene, soil=soil, movement=movement)).isel(increment=-1)
            deflection, width = (1e3 * float(wall[name]) for name in ("central_deflection", "crack_width_max"))
            rows.append(
                {
                    "movement": kind,
                    "soil (kPa/m)": f"{value / 1e3:g}",
                    "deflection of the footing (mm)": f"{deflection:.2f}",
                    "widest joint (mm)": f"{width:.2f}",
                    "category": int(wall["damage_category"]),
                }
            )
    return pd.DataFrame(rows)


def by_bricks(millimetres: float = 100.0) -> pd.DataFrame:
    """Widest joint (mm) of the mean wall over the veneer footing in doming, with each model of the bricks."""
    scene = settings("veneer", "doming", millimetres).scene
    rows = []
    for bricks, accuracy in {"rigid": "standard", "elastic": "fine", "zones of 40 mm": "reference"}.items():
        movement = replace(scene.movement, increments=5)
        wall = solve(replace(scene, solver=scene.solver.with_accuracy(accuracy), movement=movement), store_zones=False)
        path = zip(wall["surface_movement"].values[1:], wall["crack_width_max"].values[1:], strict=True)
        rows.append(
            {"bricks": bricks, **{f"y_s = {1e3 * moved:.0f} mm": f"{1e3 * width:.2f}" for moved, width in path}}
        )
    return pd.DataFrame(rows)


def settings(footing: str, kind: str, millimetres: float) -> StudySettings:
    """Return the study of house.toml with another footing, way of movement, and largest y_s (mm)."""
    base = StudySettings.from_toml(HERE / "house.toml")
    known = standard_footing("M", FOOTINGS[footing])
    scene, concrete = base.scene, base.scene.footing.concrete
    assert concrete is not None
    size = f"{known.depth * 1e3:.0f} x {known.width * 1e3:.0f}, {known.mesh}"
    title = f"house wall, {kind} to y_s = {millimetres:g} mm, footing {size}"
    return replace(
        base,
        study=replace(base.study, title=title),
        scene=replace(
            scene,
            title=title,
            footing=replace(
                scene.footing, depth=known.depth, width=known.width, concrete=replace(concrete, bottom=known.mesh)
            ),
            movement=replace(scene.movement, kind=kind, increments=max(2, round(millimetres / STEP))),
            mound=replace(scene.mound, surface_movement=millimetres * 1e-3),
        ),
    )


def place(output: Path, footing: str, kind: str, millimetres: float) -> Path:
    """Return the folder of one study."""
    return output / f"{footing}_{kind}_{millimetres:g}mm.dp"


def studies_of(output: Path, footing: str, kind: str) -> dict[float, xr.Dataset]:
    """Return the studies in a folder by the largest y_s (mm) of their paths."""
    found = {}
    for folder in output.glob(f"{footing}_{kind}_*mm.dp"):
        found[float(folder.name.removeprefix(f"{footing}_{kind}_").removesuffix("mm.dp"))] = open_study(folder)
    return dict(sorted(found.items()))


def report(output: Path) -> tuple[pd.DataFrame, bool]:
    """Write tables and curves of all studies in a folder; return the shares, and whether walls failed."""
    rows, thirds, fits, curves, failed = [], [], [], {}, False
    for footing, kind in ((f, k) for f in FOOTINGS for k in KINDS):
        studies = studies_of(output, footing, kind)
        if not studies:
            continue
        for largest, ds in studies.items():
            for sample in ds["sample"].values[ds["status"].values == 2]:
                failed = True
                print(f"failed: damagepred replay {place(output, footing, kind, largest)} {sample}")
        for millimetres in (m for m in MOVEMENTS if m <= max(studies)):
            far_enough = [ds for largest, ds in studies.items() if largest >= millimetres]
            ds = read_at(max(far_enough, key=lambda one: one.sizes["sample"]), 1e-3 * millimetres)
            site = site_class(1e-3 * millimetres).name
            case = {"footing": footing, "movement": kind, "y_s (mm)": millimetres, "site class": site}
            rows += [case | row for row in shares(ds)]
            thirds += [case | row for row in by_thirds(ds, STIFFNESS[kind])]
        found = fit_fragility(studies[max(studies)])
        found.attrs["title"] = f"{kind}, footing {settings(footing, kind, 40.0).title.split('footing ')[1]}"
        curves[footing, kind] = found
        frame = found[["probability", "probability_lower", "probability_upper"]].to_dataframe().reset_index()
        fits.append(frame.assign(footing=footing, movement=kind))
    shared = pd.DataFrame(rows)
    save_table(shared, output / "probabilities.csv")
    save_table(pd.DataFrame(thirds), output / "by_soil_stiffness.csv")
    save_table(pd.concat(fits), output / "curves.csv")
    medians = [
        found[[n for n in found.data_vars if found[n].dims == ("category",)]]
        .to_dataframe()
        .reset_index()
        .assign(footing=footing, movement=kind)
        for (footing, kind), found in curves.items()
    ]
    save_table(pd.concat(medians), output / "medians.csv")
    draw(curves, shared, output / "fragility.png")
    draw_one(output, *PICTURE)
    print("Share of the walls in the category or worse:")
    print(shared.pivot_table(index=["footing", "movement", "category"], columns="y_s (mm)", values="share").to_string())
    return shared, failed


def save_table(frame: pd.DataFrame, path: Path) -> None:
    """Write a table as CSV."""
    write_whole(path, lambda p: frame.to_csv(p, index=False, float_format="%.6g"))


def draw(curves: dict[tuple[str, str], object], shared: pd.DataFrame, path: Path) -> None:
    """Draw the curves of all cases: a row for each footing, and the shares at each y_s with their intervals."""
    footings = list(dict.fromkeys(footing for footing, _ in curves))
    kinds = list(dict.fromkeys(kind for _, kind in curves))
    figure = new_figure(7.0 * len(kinds), 6.0 * len(footings))
    panels = figure.subplots(len(footings), len(kinds), squeeze=False)
    for (footing, kind), found in curves.items():
        ax = panels[footings.index(footing)][kinds.index(kind)]
        draw_fragility(found.drop_vars("empirical"), ax)
        own = shared[(shared["footing"] == footing) & (shared["movement"] == kind)]
        for category, part in own.groupby("category"):
            # bars for shares above zero; for the others the table has the upper bound
            part = part.assign(upper=part["upper"].where(part["reached"] > 0, part["share"]))
            x, share = part["y_s (mm)"] + 0.6 * (category - 2.5), part["share"]
            ax.errorbar(
                x,
                share,
                yerr=[share - part["lower"], part["upper"] - share],
                fmt="o",
                markersize=3.5,
                linewidth=1.0,
                color=CATEGORY_COLOURS[int(category)],
                zorder=5,
                clip_on=False,
            )
        title = str(found.attrs["title"])
        set_title(
            ax,
            title[:1].upper() + title[1:],
            f"{found.attrs['samples']} walls; dots: shares; bars and bands: 90 % confidence",
        )
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))


def draw_one(output: Path, footing: str, kind: str, millimetres: float) -> None:
    """Draw the wall of median crack width among those of the worst category at a y_s (mm)."""
    studies = {largest: ds for largest, ds in studies_of(output, footing, kind).items() if largest >= millimetres}
    if not studies:
        return
    largest = max(studies)
    ds = read_at(studies[largest], 1e-3 * millimetres).isel(increment=-1)
    worst = ds.isel(sample=ds["damage_category"].values == ds["damage_category"].values.max())
    middle = worst.isel(sample=worst["crack_width_max"].argsort().values[worst.sizes["sample"] // 2])
    sample = int(middle["sample"])
    wall, _ = replay(place(output, footing, kind, largest), sample)
    increment = int(abs(wall["surface_movement"].values - 1e-3 * millimetres).argmin())
    ax = draw_wall(wall, increment=increment)
    figure = ax.get_figure()
    assert figure is not None
    write_whole(output / "wall.png", lambda p: figure.savefig(p, dpi=DPI, format="png"))
    print(f"wall.png: sample {sample}, category {int(middle['damage_category'])} at y_s = {millimetres:g} mm")


if __name__ == "__main__":
    sys.exit(main())
