"""Probability of damage to a house wall on reactive clay: class of site by class of site, footing by footing.

    python studies/soil_movement/run.py [--samples 32] [--workers 2] [--footings veneer full_masonry]
        [--kinds doming dishing] [--movements 20 40 60] [--output studies/soil_movement/results]

Every footing, way of movement and y_s is a study of its own, with the same sampled walls, in a folder that damagepred
reads (status, replay, plot). The same call goes on where an interrupted one stopped; a larger --samples adds walls,
other --movements more points to the curves. Tables and curves are made from all that is in the output folder.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
from stripes import by_thirds, shares, stripes

from damagepred import fit_fragility, open_study
from damagepred.archive.files import write_whole
from damagepred.plotting.categories import COLOURS
from damagepred.plotting.fragility import draw_fragility
from damagepred.plotting.sheet import DPI, new_figure, set_title
from damagepred.scene.site import site_class, standard_footing
from damagepred.study import Study
from damagepred.study.settings import StudySettings

HERE = Path(__file__).resolve().parent
FOOTINGS = {"light": "clad_frame", "veneer": "masonry_veneer", "full_masonry": "full_masonry"}
KINDS = ("doming", "dishing")
MOVEMENTS = {"doming": (20, 40, 60, 75, 85, 100, 125, 150), "dishing": (20, 40, 60, 75, 100, 150)}
"""Surface movements y_s (mm): the limits of the classes, and as many beyond as the curves need."""
STIFFNESS = {"doming": "soil.shrinking_stiffness", "dishing": "soil.swelling_stiffness"}
STEP = 10.0
"""Increments of the movement (mm)."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=32, help="walls to sample, a power of two at best")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--footings", nargs="+", choices=list(FOOTINGS), default=["veneer", "full_masonry"])
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument(
        "--movements", nargs="+", type=float, help="y_s (mm), each with its own mound, instead of the usual ones"
    )
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder for archives, tables, pictures")
    options = parser.parse_args()
    cases = [(f, k) for f in options.footings for k in options.kinds]
    wanted = {k: options.movements or MOVEMENTS[k] for k in options.kinds}
    everything = sorted({m for movements in wanted.values() for m in movements})
    for millimetres in everything:  # the dear ones last
        for footing, kind in cases:
            if millimetres not in wanted[kind]:
                continue
            study = Study(settings(footing, kind, millimetres))
            folder = place(options.output, footing, kind, millimetres)
            summary = study.run(folder, options.samples, workers=options.workers)
            print(f"{folder.name}: {summary.done} walls, {summary.failed} failed, {summary.seconds:.0f} s", flush=True)
            if summary.interrupted:
                return 130
    return 3 * report(options.output)


def settings(footing: str, kind: str, millimetres: float) -> StudySettings:
    """Return the study of house.toml with another footing, way of movement, and y_s (mm)."""
    base = StudySettings.from_toml(HERE / "house.toml")
    known = standard_footing("M", FOOTINGS[footing])
    scene, concrete = base.scene, base.scene.footing.concrete
    assert concrete is not None
    size = f"{known.depth * 1e3:.0f} x {known.width * 1e3:.0f}, {known.mesh}"
    title = f"house wall, {kind}, y_s = {millimetres:g} mm, footing {size}"
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


def present(output: Path, footing: str, kind: str) -> list[float]:
    """Return the movements (mm) of which there is a study."""
    names = [p.name for p in output.glob(f"{footing}_{kind}_*mm.dp")]
    return sorted(float(name.removeprefix(f"{footing}_{kind}_").removesuffix("mm.dp")) for name in names)


def report(output: Path) -> bool:
    """Write tables and curves of all studies in a folder; say which walls failed, and return whether any did."""
    rows, thirds, fits, curves, failed = [], [], [], {}, False
    for footing, kind in ((f, k) for f in FOOTINGS for k in KINDS):
        studies = {}
        for millimetres in present(output, footing, kind):
            ys, folder = millimetres * 1e-3, place(output, footing, kind, millimetres)
            case = {"footing": footing, "movement": kind, "y_s (mm)": 1e3 * ys, "site class": site_class(ys).name}
            ds = studies[ys] = open_study(folder)
            rows += [case | row for row in shares(ds)]
            thirds += [case | row for row in by_thirds(ds, STIFFNESS[kind])]
            for sample in ds["sample"].values[ds["status"].values == 2]:
                failed = True
                print(f"failed: damagepred replay {folder} {sample}")
        if not studies:
            continue
        found = fit_fragility(stripes(studies))
        found.attrs["title"] = f"{kind}, footing {settings(footing, kind, 40.0).title.split('footing ')[1]}"
        curves[footing, kind] = found
        frame = found[["probability", "probability_lower", "probability_upper"]].to_dataframe().reset_index()
        fits.append(frame.assign(footing=footing, movement=kind))
    shared = pd.DataFrame(rows)
    save_table(shared, output / "probabilities.csv")
    save_table(pd.DataFrame(thirds), output / "by_soil_stiffness.csv")
    save_table(pd.concat(fits), output / "curves.csv")
    medians = [
        found[[n for n in found.data_vars if found[n].dims == ("category",)]].to_dataframe().reset_index()
        .assign(footing=footing, movement=kind) for (footing, kind), found in curves.items()
    ]  # fmt: skip
    save_table(pd.concat(medians), output / "medians.csv")
    draw(curves, shared, output / "fragility.png")
    print("Share of the walls in the category or worse:")
    print(shared.pivot_table(index=["footing", "movement", "category"], columns="y_s (mm)", values="share").to_string())
    return failed


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
            # a bar for what has happened; of what has not, the table has the upper bound
            part = part.assign(upper=part["upper"].where(part["reached"] > 0, part["share"]))
            x, share = part["y_s (mm)"] + 0.6 * (category - 2.5), part["share"]
            ax.errorbar(
                x, share, yerr=[share - part["lower"], part["upper"] - share], fmt="o", markersize=3.5, linewidth=1.0,
                color=COLOURS[int(category)], zorder=5, clip_on=False,
            )  # fmt: skip
        title = str(found.attrs["title"])
        set_title(
            ax, title[:1].upper() + title[1:],
            f"{found.attrs['samples']} walls; dots: shares; bars and bands: 90 % confidence",
        )  # fmt: skip
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))


if __name__ == "__main__":
    sys.exit(main())
