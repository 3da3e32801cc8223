"""The page of one wall."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import xarray as xr

from damagepred.archive.schema import category_label, is_dynamic
from damagepred.damage import HAIRLINE
from damagepred.enumerations import PathStatus
from damagepred.errors import InputError
from damagepred.formatting import length, number, ratio
from damagepred.report.caveats import wall_caveats
from damagepred.report.house import house_damage, house_drawings, house_facts
from damagepred.report.inputs import input_section
from damagepred.report.limits import wall_limits
from damagepred.report.parts import Drawing, Listing, Page, Part, Section, Text, drawing
from damagepred.report.quality import wall_quality
from damagepred.report.summary import wall_summary
from damagepred.results.house import is_house
from damagepred.results.rejudge import footing_gap_note, has_dpc, measure_in_words, shown_gaps
from damagepred.results.tables import Table, crack_columns, path_columns
from damagepred.results.wall_cracks import WallCracks, crack_frame
from damagepred.scene import Scene
from damagepred.scene.described import plain
from damagepred.scene.scene import archived_scene
from damagepred.uq.intensity import movement_measure, movement_words

MOST_ROWS, MOST_CRACKS = 60, 8
"""Increments and cracks that the tables of a wall list at most."""

_SCENE_FILE = "Scene file, complete with defaults"
NEEDED = ("contact_opening", "damage_category", "crack_width_max", "central_deflection", "block_x")


def wall_page(ds: xr.Dataset, origin: str, written: str) -> Page:
    """Return the report of one wall."""
    house = is_house(ds)
    for name in NEEDED:
        if name not in ds.variables and not (house and name == "central_deflection"):
            raise InputError(
                f"{origin}: is not the result of solve or replay (it has no {name}); a report needs one of these, or a "
                "study folder."
            )
    if "scene" not in ds.attrs:
        raise InputError(f"{origin}: has no scene, so its wall is unknown; a report needs a wall solved from a scene.")
    scene = archived_scene(ds.attrs, f"{origin} scene")
    report = {} if scene.report is None else plain(scene.report)
    sampled = f", sample {int(ds.attrs['sample'])} of a study" if "sample" in ds.attrs else ""
    limited = not (house or is_dynamic(ds) or "span" not in ds.attrs or "load_force" in ds)
    at_limits = wall_limits(ds) if limited else None
    what = f"a house of {ds.sizes['wall']} walls" if house else "one wall"
    return Page(
        title=str(ds.attrs.get("title", "masonry wall")),
        subtitle=f"Damage to {what}{sampled}, {written[:10]}",
        warnings=_warnings(ds),
        question="As the ground moves:",
        answers=wall_summary(ds),
        facts=house_facts(ds) if house else _facts(ds, scene),
        head=report,
        first=[*(house_drawings(ds) if house else [wall_drawing(ds, "wall")]), _history(ds)],
        sections=[
            Section("damage", "Damage", [*house_damage(ds), *crack_parts(ds)] if house else damage_parts(ds)),
            *filter(None, [at_limits]),
            wall_caveats(ds, scene),
        ],
        appendix=[
            input_section(scene, attributes=ds.attrs),
            Section("run", "What was run", [_run(ds, origin, written)]),
            Section("quality", "How good the solution is", [*wall_quality(ds), _path_table(ds)]),
            Section("files", "The scene in full", [Listing(_SCENE_FILE, ds.attrs["scene"].strip())]),
        ],
    )


def _warnings(ds: xr.Dataset) -> list[str]:
    status = str(ds.attrs.get("status", PathStatus.COMPLETE))
    message = str(ds.attrs.get("status_message", ""))
    gap = footing_gap_note(ds)
    said = [f"{gap[0].upper()}{gap[1:]}."] if gap else []
    if status == PathStatus.COMPLETE:
        return said
    if status == PathStatus.COLLAPSED:
        return [f"The wall collapsed: {message}" if message else "The wall collapsed.", *said]
    reason = f"{status}{': ' + message if message else ''}"
    return [f"The path is not complete: {reason}. What follows is of its first part.", *said]


def _facts(ds: xr.Dataset, scene: Scene) -> list[tuple[str, str]]:
    category = category_label(ds, int(ds["damage_category"].values[-1]))
    movement = f"laboratory test, loads moved by {length(float(ds[movement_measure(ds)].values[-1]))}"
    if "load_force" in ds.variables:
        movement += f"; largest load {number(1e-3 * float(np.nanmax(ds['load_force'].values)), 3)} kN"
    elif "settlement" in ds.variables:
        movement = f"{movement_words(ds)} of {length(float(ds['settlement'].values[-1]))}, deflection"
    else:
        movement = f"{scene.movement.kind}, footing deflected by {length(float(ds['central_deflection'].values[-1]))}"
    if "deflection_ratio" in ds.variables and (share := float(ds["deflection_ratio"].values[-1])) > 0:
        movement += f" ({ratio(share)} of its length)"
    if "surface_movement" in ds.variables:
        movement += f" under a {movement_words(ds)} of {length(float(ds['surface_movement'].values[-1]))}"
    facts = [
        ("Movement", movement),
        ("Damage", f"category {category} ({ds.attrs.get('damage_table', '')}), by the {measure_in_words(ds)}"),
        ("Widest crack", length(float(ds["crack_width_max"].values[-1]))),
    ]
    if "crack_band_width_max" in ds.variables:
        facts.append(("Widest crack band", _band(ds)))
    if scene.dpc is not None:
        facts.append(("Damp-proof course", _gap(ds, "dpc")))
    if "footing" in shown_gaps(ds):
        facts.append(("Bed on the footing", _gap(ds, "footing")))
    for i, opening in enumerate(scene.opening):
        change = length(float(ds["opening_width_change"].values[-1, i]))
        facts.append((f"{opening.kind.capitalize()} {i + 1}", f"changes its width by {change} (widening positive)"))
    return facts


def _gap(ds: xr.Dataset, part: str) -> str:
    opened, over = (float(ds[f"{part}_{name}"].values[-1]) for name in ("opening_max", "separation_length"))
    threshold = float(ds[f"{part}_separation_length"].attrs.get("opening_threshold", np.nan))
    return f"opens by {length(opened)} at most, by more than {length(threshold)} over {number(over, 3)} m"


def _band(ds: xr.Dataset) -> str:
    gauge = number(float(ds["crack_band_width_max"].attrs.get("gauge_length", np.nan)), 3)
    text = f"{length(float(ds['crack_band_width_max'].values[-1]))}, openings of neighbouring joints along {gauge} m"
    if "damage_category_band" in ds.variables and ds.attrs.get("damage_measure", "joint") == "joint":
        category = int(ds["damage_category_band"].values[-1])
        text += f"; by it the category would be {category_label(ds, category, 'damage_category_band')}"
    return text


def _run(ds: xr.Dataset, origin: str, written: str) -> Table:
    commit = str(ds.attrs.get("damagepred_commit", "unknown"))
    rows = [
        ["file", origin],
        ["program", f"damagepred {ds.attrs.get('damagepred_version', '?')}, commit {commit}"],
        ["report written", written],
        ["solver", str(ds.attrs.get("solver_method", "?")).replace("_", "-")],
        ["blocks", str(ds.sizes["block"])],
        ["contacts", str(ds.sizes["contact"])],
        ["increments", str(ds.sizes["increment"] - 1)],
        ["how the path ended", str(ds.attrs.get("status", "?"))],
    ]
    if "zones" in ds.attrs:
        rows.insert(5, ["zones", f"{ds.attrs['zones']} in {ds.attrs['deformable_blocks']} deformable blocks"])
    if "sample" in ds.attrs:
        rows.insert(3, ["sample", f"{int(ds.attrs['sample'])}, of a study with seed {int(ds.attrs['seed'])}"])
    return Table("Program and run", ["", ""], rows, words=(0, 1))


def _history(ds: xr.Dataset) -> Drawing:
    """Widest crack and gaps against the movement."""
    from damagepred.plotting import draw_history

    course = " and opening of the damp-proof course" * has_dpc(ds)
    return drawing(
        "history",
        f"Widest crack{course} as the ground moves.",
        f"Widest crack{course} against the movement, over the bands of the damage categories",
        draw_history(ds),
        along="movement",
    )


def crack_parts(ds: xr.Dataset) -> list[Part]:
    """Drawing and table of a wall's cracks at the end of its path."""
    traced = None if is_house(ds) else WallCracks(ds)
    frame = crack_frame(ds if traced is None else traced.dataset())
    if frame.empty:
        return [Text([f"No joint has opened or slid by more than {length(HAIRLINE)}."])]
    figures: list[Part] = []
    if traced is not None:
        from damagepred.plotting import draw_cracks

        caption = "The cracks where they run, on the undeformed wall; the table has the same numbers."
        label = f"Drawing of the wall with {len(frame)} numbered cracks, coloured by width"
        figures = [drawing("cracks", caption, label, draw_cracks(ds, traced=traced))]
    note = (
        "Width is the largest opening normal to a joint, which damage tables speak of; the displacement has the slip "
        f"in it. What has opened or slid by more than {length(HAIRLINE)} and touches is one crack. Length "
        "includes branches."
    )
    if "crack_wall" in frame:
        frame = frame.sort_values("crack_width", ascending=False)
    if len(frame) > MOST_CRACKS:
        note = f"The first {MOST_CRACKS} of {len(frame)}, the widest of each part of the wall first. {note}"
    caption = "Cracks at the end of the path, the widest of each part of the wall first"
    return [*figures, Table.of(caption, crack_columns(frame.head(MOST_CRACKS), is_dynamic(ds)), note)]


def damage_parts(ds: xr.Dataset) -> list[Part]:
    """Drawings and tables of the damage to one wall."""
    from damagepred.plotting import draw

    gaps, beam = shown_gaps(ds), "section_x" in ds.variables
    dpc, bed = "Opening of the damp-proof course along the wall", "Opening of the bed"
    along, moment = "along the wall at several movements", "Bending moment in the footing along the wall"
    drawn = (
        ("dpc" in gaps, "dpc", "dpc_opening", f"{dpc}.", f"{dpc} at several movements"),
        (
            "footing" in gaps,
            *("footing-gap", "footing_opening", f"{bed} between first course and footing along the wall."),
            f"{bed} on the footing {along}",
        ),
        (
            ds.sizes.get("opening"),
            *("openings", "opening_width_change", "Change of width of the openings; widening is positive."),
            "Change of width of each opening against the movement",
        ),
        (beam, "footing", "footing_rise", "Rise of the footing along the wall.", f"Rise of the footing {along}"),
        (beam, "moment", "section_moment", f"{moment}, sagging positive.", f"{moment} at several movements"),
    )
    return [
        *crack_parts(ds),
        *(drawing(name, caption, label, draw(ds, key)) for there, name, key, caption, label in drawn if there),
    ]


def wall_drawing(
    ds: xr.Dataset, name: str, caption: str = "", walls: Mapping[str, xr.Dataset] | None = None
) -> Drawing:
    """Drawing of a wall at the end of its path."""
    from damagepred.plotting import draw_wall

    category = category_label(ds, int(ds["damage_category"].values[-1]))
    width = length(float(ds["crack_width_max"].values[-1]))
    where = f"at a {movement_words(ds)} of {length(float(ds[movement_measure(ds)].values[-1]))}"
    label = f"Deformed wall {where}: damage category {category}, widest crack {width}"
    ax = draw_wall(ds)
    caption += f"{label}; cracks coloured by width, displacements exaggerated."
    return drawing(name, caption, label, ax, walls=walls or {"the wall": ds})


def _path_table(ds: xr.Dataset) -> Table:
    """Table of the path, one row per increment, at most ``MOST_ROWS``."""
    count = ds.sizes["increment"]
    rows = np.unique(np.linspace(0, count - 1, min(count, MOST_ROWS)).round().astype(int))
    columns = [replace(column, cells=[column.cells[i] for i in rows]) for column in path_columns(ds)]
    return Table.of("The wall's path", columns, f"{len(rows)} of {count} increments." if len(rows) < count else "")
