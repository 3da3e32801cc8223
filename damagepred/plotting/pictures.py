"""Pictures in files, each written completely or not at all."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from damagepred.archive.files import PICTURES, check_output, write_whole
from damagepred.archive.schema import is_dynamic, require
from damagepred.inputs.arguments import checked
from damagepred.plotting import sheet
from damagepred.plotting.analyses import (
    draw_back_analysis,
    draw_comparison,
    draw_design_search,
    draw_portfolio,
    draw_scales,
    draw_sensitivity,
)
from damagepred.plotting.cracks import draw_cracks
from damagepred.plotting.field import draw
from damagepred.plotting.fragility import draw_fragility
from damagepred.plotting.geometry import Deformed
from damagepred.plotting.history import draw_history
from damagepred.plotting.house import draw_axonometric, draw_plan, draw_unfolded
from damagepred.plotting.scene import draw_scene
from damagepred.plotting.stress import stress_levels
from damagepred.plotting.study import draw_category_shares
from damagepred.plotting.wall import draw_wall
from damagepred.results.house import house_of, is_house, unfolded
from damagepred.results.rejudge import has_dpc, shown_gaps
from damagepred.scene import House, Scene
from damagepred.uq.fragility import fit_fragility

MOST_FRAMES, FRAME_DPI, FRAME_TIME = 41, 80, 200
"""Frames of a moving picture at most, their resolution (dots per inch), and time of each (ms)."""

GOODNESS = 100  # times that walls are made up to judge the fit of the curves of a study's picture


@checked
def save_wall_pictures(ds: xr.Dataset, folder: str | Path) -> list[Path]:
    """Draw one wall, or a house: ``plan.png``, ``unfolded.png`` and ``house.png``.

    ``wall.png``, ``dpc_opening.png`` if it has a dpc, ``opening_width.png`` if it has openings, ``history.png``, and
    ``cracks.png`` and ``stress_xx.png`` for a static path; of a footing that finds its own form ``footing.png``, and on
    jacks ``jack_load.png``; of a laboratory test ``load.png``; of deformable blocks also ``stress_yy.png``,
    ``stress_xy.png``, ``principal_stress.png`` and, if any zone has yielded, ``zone_states.png``.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of one wall (``damagepred.solve``).
    folder : str or Path
        Folder to write to; made if it does not exist.

    Examples
    --------
    >>> import damagepred, xarray
    >>> files = damagepred.plotting.save_wall_pictures(xarray.open_dataset("wall.nc"), "wall")
    >>> [file.name for file in files][:3]
    ['wall.png', 'footing_opening.png', 'opening_width.png']
    """
    check_output(folder)
    if is_house(ds):
        drawings = {"plan": draw_plan(house_of(ds), ds), "unfolded": draw_unfolded(ds), "house": draw_axonometric(ds)}
        return _save_all({f"{name}.png": sheet.figure_of(ax) for name, ax in drawings.items()}, folder)
    drawn = {"wall": draw_wall(ds)} | {f"{bed}_opening": draw(ds, f"{bed}_opening") for bed in shown_gaps(ds)}
    if ds.sizes.get("opening", 0):
        drawn["opening_width"] = draw(ds, "opening_width_change")
    if not is_dynamic(ds):
        drawn["cracks"] = draw_cracks(ds)
    drawn["history"] = draw_history(ds)
    if "crack_width_worst" in ds.variables:
        drawn["hysteresis"] = draw(ds, "dpc_opening_max" if has_dpc(ds) else "crack_width_max")
    if "load_force" in ds.variables:
        gauge = "gauge_opening" if "gauge_opening" in ds.variables else "load_displacement"
        drawn["load"] = draw(ds, "load_force", against=gauge)
    if "section_moment" in ds.variables:
        axes = sheet.several_or_new(None, 3, 9.0, 11.0)
        for ax, name in zip(axes, ("footing_rise", "section_moment", "section_curvature")):
            drawn["footing"] = draw(ds, name, ax)
    if "jack_load" in ds.variables:
        drawn["jack_load"] = ax = draw(ds, "support_load", draw(ds, "jack_load", label="each jack"))
        ax.set_ylabel("load, upwards positive (kN)")
        circle = "circle: jacks or a support carry no load any more" * ("limit" in ds.attrs)
        sheet.set_title(ax, sheet.title_of(ds, "wall"), circle)
    return _save_all({f"{name}.png": sheet.figure_of(ax) for name, ax in drawn.items()} | stress_sheets(ds), folder)


def stress_sheets(ds: xr.Dataset) -> dict[str, Figure]:
    """Stresses half-way and at the end; of rigid blocks, which have one mean each, along the wall at the end."""
    if "zone_state" not in ds:
        return {} if is_dynamic(ds) else {"stress_xx.png": sheet.figure_of(draw(ds, "stress_xx"))}
    last, components = ds.sizes["increment"] - 1, ("stress_xx", "stress_yy", "stress_xy")
    sheets = {f"{name}.png": stress_sheet(ds, [(name, i) for i in sorted({half_way(ds), last})]) for name in components}
    sheets["principal_stress.png"] = stress_sheet(ds, [("stress_largest", last), ("stress_smallest", last)])
    if ds["zone_state"].values.any():
        sheets["zone_states.png"] = sheet.figure_of(draw(ds, "zone_state"))
    return sheets


def half_way(ds: xr.Dataset) -> int:
    """Position of the first increment with half of the last one's progress."""
    progress = ds["progress"].values
    return int(np.argmax(progress >= 0.5 * progress[-1] - 1e-9))


def stress_sheet(ds: xr.Dataset, panels: list[tuple[str, int]]) -> Figure:
    """Stresses at positions of increments one below the other, each with the same colours at all of them."""
    walls = [Deformed.of(ds, increment, None) for _, increment in panels]
    figure = sheet.new_figure(10.0, sum(sheet.height_to_scale(wall.shape, 2.2) for wall in walls))
    figure.set_layout_engine("constrained", w_pad=0.12)  # drawings to scale are shifted in their places
    for ax, (name, increment) in zip(np.atleast_1d(figure.subplots(len(panels), 1)), panels):
        levels = stress_levels(ds, name, [i for n, i in panels if n == name])
        draw(ds, name, ax, increment=increment, exaggeration=walls[-1].factor, levels=levels)
    return figure


def save_scene_picture(scene: Scene, path: Path) -> Path:
    """Drawing of a scene in a file, or as ``scene.png`` in a folder."""
    file = path if path.suffix.lower() in PICTURES and not path.is_dir() else path / "scene.png"
    ax = draw_plan(scene) if isinstance(scene, House) else draw_scene(scene)
    return _save_all({file.name: sheet.figure_of(ax)}, file.parent)[0]


@checked
def save_study_pictures(ds: xr.Dataset, folder: str | Path) -> list[Path]:
    """Draw a study: ``fragility.png``, and of paths ``crack_widths.png`` and ``category_shares.png``.

    Parameters
    ----------
    ds : xarray.Dataset
        Study (``damagepred.open_study``).
    folder : str or Path
        Folder to write to; made if it does not exist.

    Examples
    --------
    >>> import damagepred
    >>> files = damagepred.plotting.save_study_pictures(damagepred.open_study("house.dp"), "study")
    >>> [file.name for file in files]
    ['fragility.png', 'crack_widths.png', 'category_shares.png']
    """
    check_output(folder)
    require(ds, ("damage_category", "status"), "a study of `damagepred.open_study`")
    sheets = {"fragility.png": sheet.figure_of(draw_fragility(fit_fragility(ds, goodness=GOODNESS)))}
    if ds["damage_category"].ndim == 2:
        sheets["crack_widths.png"] = sheet.figure_of(draw(ds, "crack_width_max"))
        sheets["category_shares.png"] = sheet.figure_of(draw_category_shares(ds))
    return _save_all(sheets, folder)


@checked
def save_animation(ds: xr.Dataset, path: str | Path) -> Path:
    """Draw the path of a wall or a house as a moving picture (GIF), with the exaggeration of its end.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of one wall (``damagepred.solve``).
    path : str or Path
        File ending in .gif.

    Examples
    --------
    >>> import damagepred, xarray
    >>> damagepred.plotting.save_animation(xarray.open_dataset("wall.nc"), "wall.gif").name
    'wall.gif'
    """
    from PIL import Image  # matplotlib requires it

    check_output(file := Path(path), ".gif", new_folder=True)
    draw_state = draw_axonometric if is_house(ds) else draw_wall
    end = draw_state(ds)
    figure, factor = sheet.figure_of(end), Deformed.of(unfolded(ds) if is_house(ds) else ds, -1, None).factor
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    box, place, limits = figure.get_tightbbox().padded(0.1), end.get_position(), (*end.get_xlim(), *end.get_ylim())
    frames = []
    for step in sheet.spread_evenly(ds.sizes["increment"], MOST_FRAMES):
        figure.clear()
        ax = draw_state(ds, figure.add_subplot(), increment=int(step), exaggeration=factor)
        ax.set_position(place)
        ax.axis(limits)
        figure.savefig(stream := BytesIO(), dpi=FRAME_DPI, bbox_inches=box)
        frames.append(Image.open(stream).convert("RGB"))
    times = [FRAME_TIME] * (len(frames) - 1) + [10 * FRAME_TIME]
    how: dict[str, Any] = {"format": "GIF", "save_all": True, "duration": times, "loop": 0}
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, lambda p: frames[0].save(p, append_images=frames[1:], **how))
    return file


@checked
def save_fragility_picture(curves: xr.Dataset, path: str | Path) -> Path:
    """Draw fragility curves, a surface, or the result of another analysis of studies into a file.

    Parameters
    ----------
    curves : xarray.Dataset
        Result of ``fit_fragility``, ``fit_surface``, ``compare``, ``infer``, ``search_design``, ``assess_portfolio``,
        ``compare_scales`` or ``study_sensitivity``.
    path : str or Path
        File ending in .png, .pdf or .svg; its folder is made if it does not exist.

    Examples
    --------
    >>> import damagepred
    >>> curves = damagepred.fit_fragility(damagepred.open_study("house.dp"), bootstrap=20)
    >>> damagepred.plotting.save_fragility_picture(curves, "curves.png").name
    'curves.png'
    """
    file = Path(path)
    check_output(file, *PICTURES, new_folder=True)
    draw_result = next((draw for name, draw in _DRAWINGS.items() if name in curves), draw_fragility)
    drawing = draw_result(curves)
    ax = drawing[0] if isinstance(drawing, list) else drawing
    return _save_all({file.name: sheet.figure_of(ax)}, file.parent)[0]


_DRAWINGS: dict[str, Callable[[xr.Dataset], Axes | list[Axes]]] = {
    "posterior": draw_back_analysis,
    "extra_cost": draw_design_search,
    "walls": draw_portfolio,
    "agreement": draw_scales,
    "spearman": draw_sensitivity,
    "difference": draw_comparison,
}
"""Drawing of a result by the name of a variable that no other result has."""


def _save_all(sheets: dict[str, Figure], folder: str | Path) -> list[Path]:
    files = [Path(folder) / name for name in sheets]
    files[0].parent.mkdir(parents=True, exist_ok=True)
    for file, figure in zip(files, sheets.values()):
        # drawings to scale may reach beyond a sheet of another shape: save all of them
        how = {"dpi": sheet.DPI, "format": file.suffix.lstrip(".").lower(), "bbox_inches": "tight", "pad_inches": 0.1}
        write_whole(file, lambda place, f=figure, h=how: f.savefig(place, **h))  # type: ignore[misc]
    return files
