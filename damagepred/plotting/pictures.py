"""Pictures in files: each written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from damagepred.archive.files import PICTURES, check_output, write_whole
from damagepred.archive.schema import is_dynamic
from damagepred.arrays import FloatArray
from damagepred.enumerations import ContactKind
from damagepred.inputs.arguments import checked
from damagepred.plotting.back_analysis import draw_back_analysis
from damagepred.plotting.comparison import draw_comparison
from damagepred.plotting.cracks import cracks_sheet
from damagepred.plotting.deformed import Deformed
from damagepred.plotting.design_search import draw_design_search
from damagepred.plotting.dpc import draw_dpc_opening, draw_footing_opening
from damagepred.plotting.footing import draw_footing, draw_jack_load, has_footing
from damagepred.plotting.fragility import draw_fragility
from damagepred.plotting.fragility_surface import draw_fragility_surface
from damagepred.plotting.history import draw_history, draw_hysteresis, draw_load
from damagepred.plotting.openings import draw_opening_width_change
from damagepred.plotting.scales import draw_scales
from damagepred.plotting.sensitivity import draw_sensitivity
from damagepred.plotting.sheet import DPI, figure_of, new_figure, text_size, title_of
from damagepred.plotting.stress import draw_stress, stress_levels
from damagepred.plotting.study import draw_category_shares, draw_crack_widths
from damagepred.plotting.wall import draw_wall
from damagepred.plotting.zone_geometry import has_zones
from damagepred.plotting.zones import draw_zone_states
from damagepred.results.rejudge import shown_gaps


@checked
def save_wall_pictures(ds: xr.Dataset, folder: str | Path) -> list[Path]:
    """Draw one wall.

    ``wall.png``, ``dpc_opening.png``, ``opening_width.png`` if it has openings, ``history.png``, and ``cracks.png`` and
    ``stress_xx.png`` for a static path; of a footing that finds its own form ``footing.png``, and on jacks
    ``jack_load.png``; of a laboratory test ``load.png``; of deformable blocks also ``stress_yy.png``,
    ``stress_xy.png``, ``principal_stress.png`` and, if any zone has yielded, ``zone_states.png``.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall, as ``damagepred.solve`` returns it.
    folder : str or Path
        Where to write; made if it does not exist.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    StudyError
        If the folder cannot be written.
    InputError
        If the dataset is not of one wall.

    Examples
    --------
    >>> import damagepred, xarray
    >>> files = damagepred.plotting.save_wall_pictures(xarray.open_dataset("wall.nc"), "wall")
    >>> [file.name for file in files][:3]
    ['wall.png', 'dpc_opening.png', 'footing_opening.png']
    """
    check_output(folder)
    sheets = {"wall.png": figure_of(draw_wall(ds)), "dpc_opening.png": figure_of(draw_dpc_opening(ds))}
    if "footing" in shown_gaps(ds):
        sheets["footing_opening.png"] = figure_of(draw_footing_opening(ds))
    if ds.sizes.get("opening", 0):
        sheets["opening_width.png"] = _opening_width(ds)
    if not is_dynamic(ds):
        sheets["cracks.png"] = cracks_sheet(ds)
    sheets["history.png"] = figure_of(draw_history(ds))
    if "crack_width_worst" in ds.variables:
        sheets["hysteresis.png"] = figure_of(draw_hysteresis(ds))
    if "load_force" in ds.variables:
        sheets["load.png"] = figure_of(draw_load(ds))
    if has_footing(ds):
        sheets["footing.png"] = figure_of(draw_footing(ds)[0])
    if "jack_load" in ds.variables:
        sheets["jack_load.png"] = figure_of(draw_jack_load(ds))
    return _save_all(sheets | stress_sheets(ds), folder)


def stress_sheets(ds: xr.Dataset) -> dict[str, Figure]:
    """Draw stresses half-way and at the end; of rigid blocks, for which there is one mean each, at the end alone."""
    if not has_zones(ds):
        return {} if is_dynamic(ds) else {"stress_xx.png": figure_of(draw_stress(ds))}
    last = ds.sizes["increment"] - 1
    both = sorted({half_way(ds), last})
    sheets = {f"stress_{name}.png": stress_sheet(ds, [(name, i) for i in both]) for name in ("xx", "yy", "xy")}
    sheets["principal_stress.png"] = stress_sheet(ds, [("largest", last), ("smallest", last)])
    if ds["zone_state"].values.any():
        sheets["zone_states.png"] = figure_of(draw_zone_states(ds))
    return sheets


def half_way(ds: xr.Dataset) -> int:
    """Return the position of the first increment with half of the last one's progress."""
    progress = ds["progress"].values
    return int(np.argmax(progress >= 0.5 * progress[-1] - 1e-9))


def stress_sheet(ds: xr.Dataset, panels: list[tuple[str, int]], levels: FloatArray | None = None) -> Figure:
    """Draw stresses one under the other, the same one at several increments in the same colours."""
    walls = [Deformed.of(ds, increment, None) for _, increment in panels]
    figure = new_figure(10.0, sum(wall.sheet_height(1.4) for wall in walls))
    factor = walls[-1].factor
    figure.set_layout_engine("constrained", w_pad=0.12)  # drawings to scale are shifted in their places
    for ax, (component, increment) in zip(np.atleast_1d(figure.subplots(len(panels), 1)), panels):
        own = stress_levels(ds, component, [i for c, i in panels if c == component]) if levels is None else levels
        draw_stress(ds, ax, component, increment, factor, own)
    return figure


def _opening_width(ds: xr.Dataset) -> Figure:
    if not (ds["contact_kind"].values == ContactKind.DPC).any():
        return figure_of(draw_opening_width_change(ds))
    figure = new_figure(12.0, 5.0)
    left, right = figure.subplots(1, 2, sharey=True)
    draw_opening_width_change(ds, left)
    draw_opening_width_change(ds, right, against="dpc_opening_max")
    for ax in (left, right):
        ax.set_title("", loc="left")
    right.set_ylabel("")
    title = f"{title_of(ds, 'wall')}\nopenings: widening is positive"
    figure.suptitle(title, x=0.01, ha="left", fontsize=text_size(left))
    return figure


@checked
def save_study_pictures(ds: xr.Dataset, folder: str | Path) -> list[Path]:
    """Draw a study: ``crack_widths.png`` and ``category_shares.png``.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``damagepred.open_study`` returns it.
    folder : str or Path
        Where to write; made if it does not exist.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    StudyError
        If the folder cannot be written.
    InputError
        If the dataset is not a study, or no wall of it has been solved.

    Examples
    --------
    >>> import damagepred
    >>> files = damagepred.plotting.save_study_pictures(damagepred.open_study("house.dp"), "study")
    >>> [file.name for file in files]
    ['crack_widths.png', 'category_shares.png']
    """
    check_output(folder)
    sheets = {
        "crack_widths.png": figure_of(draw_crack_widths(ds)),
        "category_shares.png": figure_of(draw_category_shares(ds)),
    }
    return _save_all(sheets, folder)


@checked
def save_fragility_picture(curves: xr.Dataset, path: str | Path) -> Path:
    """Draw fragility curves, a surface, a comparison, a back-analysis, or what damage depends on, into a file.

    Parameters
    ----------
    curves : xarray.Dataset
        As ``damagepred.fit_fragility``, ``damagepred.fit_surface``, ``damagepred.compare``, ``damagepred.infer`` or
        ``damagepred.analyses.variance_shares.study_sensitivity`` returns it.
    path : str or Path
        Ending in .png, .pdf or .svg; its folder is made if it does not exist.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    StudyError
        If the folder cannot be written.
    InputError
        If the name ends in something else, or the dataset holds no curves.

    Examples
    --------
    >>> import damagepred
    >>> curves = damagepred.fit_fragility(damagepred.open_study("house.dp"), bootstrap=20)
    >>> damagepred.plotting.save_fragility_picture(curves, "curves.png").name
    'curves.png'
    """
    file = Path(path)
    check_output(file, *PICTURES, new_folder=True)
    if "posterior" in curves:
        return _save_all({file.name: figure_of(draw_back_analysis(curves)[0])}, file.parent)[0]
    if "extra_cost" in curves:
        return _save_all({file.name: figure_of(draw_design_search(curves)[0])}, file.parent)[0]
    if "agreement" in curves:
        return _save_all({file.name: figure_of(draw_scales(curves))}, file.parent)[0]
    if "spearman" in curves:
        return _save_all({file.name: figure_of(draw_sensitivity(curves)[0])}, file.parent)[0]
    if "difference" in curves:
        return _save_all({file.name: figure_of(draw_comparison(curves)[0])}, file.parent)[0]
    draw = draw_fragility_surface if "second" in curves.dims else draw_fragility
    return _save_all({file.name: figure_of(draw(curves))}, file.parent)[0]


def _save_all(sheets: dict[str, Figure], folder: str | Path) -> list[Path]:
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    for name, figure in sheets.items():
        kind = Path(name).suffix.lstrip(".").lower()
        # drawings to scale may be shifted out of a sheet that is not of their shape: nothing is cut off
        how = {"dpi": DPI, "format": kind, "bbox_inches": "tight", "pad_inches": 0.1}
        write_whole(place / name, lambda file, f=figure, h=how: f.savefig(file, **h))  # type: ignore[misc]
    return [place / name for name in sheets]
