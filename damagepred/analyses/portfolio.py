"""Portfolio: the same study for many houses, one row of a table per house."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damagepred.archive.files import check_output
from damagepred.archive.folder import open_study
from damagepred.campaign.campaign import Campaign
from damagepred.campaign.cost_estimate import seconds_per_wall
from damagepred.campaign.dispatch import sample_timeout
from damagepred.campaign.settings import StudySettings, study_tables
from damagepred.campaign.workers import LocalPool
from damagepred.errors import InputError, require_count
from damagepred.formatting import duration
from damagepred.inputs.arguments import checked
from damagepred.inputs.input_files import parse_toml
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Scene
from damagepred.scene.keys import merged
from damagepred.scene.number_table import NumberTable, read_number_table
from damagepred.uq.exceedance import (
    category_capacities,
    estimate_exceedance,
    exceedance,
    has_own_ground,
    own_movements,
    wanted_movement,
)
from damagepred.uq.intensity import attributes, chosen_intensity, movement_words
from damagepred.uq.movement_distribution import MovementDistribution, movement_distribution

SHORT_NAMES = {
    **{key: f"wall.{key}" for key in ("length", "height", "thickness")},
    "openings": "opening",
    "y_s": "mound.surface_movement",
    **{key: f"movement.{key}" for key in ("settlement", "central_deflection")},
}
"""Short names of columns, and the keys of the scene that they set."""
PLACES = ("longitude", "latitude", "easting", "northing")  # columns of coordinates, copied to the result
QUESTIONS = ("at", "site_class")  # columns with the movement at which the damage of a house is asked for


@dataclass(frozen=True)
class House:
    """House of a portfolio: its name, study, movement asked for, and coordinates."""

    name: str
    settings: StudySettings
    at: str
    place: tuple[float, ...]


@checked
@one_blas_thread()
def assess_portfolio(
    houses: str | Path,
    study: str | Path,
    out: str | Path,
    *,
    samples: int | None = None,
    at: str = "site",
    confidence: float = 0.9,
    workers: int = 1,
    on_house: Callable[[int, int, str], None] | None = None,
) -> xr.Dataset:
    """Probability of each damage category for each house of a table.

    Each house has a study folder of its own, with its own random numbers, which follow from the study's seed and the
    name of the house. The same call resumes; a new row of the table changes no other house.

    Parameters
    ----------
    houses : path
        CSV file or xlsx workbook, one row per house. Column ``name``; columns ``longitude`` and ``latitude``, or
        ``easting`` and ``northing``; ``at`` or ``site_class``, the movement asked for. Every other column is a key of
        the scene (``footing.depth``, ``opening.1.width``) or a short name (``length``, ``settlement``), with its unit
        in brackets or in the cell. An empty cell keeps the study's value.
    study : path
        Study file with all that the houses have in common.
    out : path
        Folder for the studies of the houses.
    samples : int, optional
        Samples per house; by default the study's own number.
    at : str
        Movement of houses without their own: "25 mm", "H1", a distribution, or "site", the end of the movement.
    confidence : float
        Confidence level of the intervals.
    workers : int
        Number of worker processes.
    on_house : callable, optional
        Called before each house with its number, the number of houses, and its name.

    Returns
    -------
    xarray.Dataset
        On (house, category): ``probability`` of the category or a worse one, with ``_lower`` and ``_upper``; it is NaN
        where no wall was followed as far. On (house,): ``at``, ``walls``, ``failed`` and coordinates.

    Raises
    ------
    InputError
        If a row does not fit the study; the message names line and column.

    Examples
    --------
    >>> import damagepred
    >>> street = damagepred.assess_portfolio("houses.csv", "house.toml", "street.portfolio")
    >>> float(street["probability"].sel(house="12 Elm Street", category=2))
    1.0
    """
    require_count("workers", workers)
    check_output(out)
    table, all_houses = read_houses(houses, study, at, samples)
    rows: list[Mapping[str, Any]] = []
    pool_limit = sample_timeout(None, Campaign(all_houses[0].settings).limits, None)
    # new workers for each house would take longer than its walls
    with LocalPool(workers, pool_limit) as pool:
        for number, house in enumerate(all_houses, 1):
            if on_house is not None:
                on_house(number, len(all_houses), house.name)
            folder = Path(out) / f"{re.sub(r'[^-A-Za-z0-9_.]+', '_', house.name)}.dp"
            folder.parent.mkdir(exist_ok=True, parents=True)
            if Campaign(house.settings).run(folder, house.settings.study.samples, executor=pool).interrupted:
                raise KeyboardInterrupt
            rows.append(_damage(open_study(folder), house, confidence))
    return _dataset(table, all_houses, rows, confidence)


def price_of_portfolio(houses: str | Path, study: str | Path, workers: int, samples: int | None, at: str) -> str:
    """Estimated cost of a portfolio; times one wall of the first, the middle and the last house."""
    _, all_houses = read_houses(houses, study, at, samples)
    timed = sorted({0, len(all_houses) // 2, len(all_houses) - 1})
    seconds = seconds_per_wall([all_houses[k].settings.scene for k in timed])
    walls = sum(house.settings.study.samples for house in all_houses)
    return f"{len(all_houses)} houses, {walls} samples: about {duration(seconds * walls / workers)}"


def read_houses(houses: str | Path, study: str | Path, at: str, samples: int | None) -> tuple[NumberTable, list[House]]:
    """Table of houses, and the study of each."""
    table, study = read_number_table(houses), Path(study)
    base = StudySettings.from_toml(study)
    if base.study.importance or base.study.sampler == "table":
        raise InputError(f"{study}: a portfolio draws its own samples; no importance, no table of samples.")
    if "name" not in table.names:
        raise InputError(f"{houses}: has no column 'name'; each house needs its own.")
    column = table.names.index("name")
    names = [str(name) for name in table.cells[column]]
    files = [re.sub(r"[^-A-Za-z0-9_.]+", "_", name).casefold() for name in names]
    for line, name, file in zip(table.cells.index, names, files):
        if not name or files.count(file) > 1:
            reason = "is empty" if not name else "is the name of another house, too"
            raise InputError(f"{houses}, line {line}, name = {name!r}: {reason}; each house needs its own.")
    if "at" in table.names and "site_class" in table.names:
        raise InputError(f"{houses}: has columns 'at' and 'site_class'; give the movement asked for once.")
    tables, folder = study_tables(study)
    places = [table.names.index(name) for name in PLACES if name in table.names]
    coordinates = np.column_stack([table.numbers(k, "1") for k in places]) if places else np.empty((len(names), 0))
    found = [_house(table, k, base, tables, (study, folder), samples, at) for k in range(len(names))]
    return table, [House(name, *own, tuple(place)) for name, own, place in zip(names, found, coordinates.tolist())]


def _house(
    table: NumberTable,
    row: int,
    base: StudySettings,
    tables: dict[str, Any],
    files: tuple[Path, Path],
    samples: int | None,
    at: str,
) -> tuple[StudySettings, str]:
    """Study of one row, and the movement asked for; ``files``: the study file, and the folder of its scene."""
    source = f"{table.path}, line {table.cells.index[row]}"
    name, keys, of_scene = "", [], tables["scene"]
    for k, header in enumerate(table.names):
        cell = str(table.cells.iloc[row, k])
        if header == "name":
            name = cell
        elif header in QUESTIONS:
            at = cell or at
        elif cell and header not in PLACES:
            keys.append(SHORT_NAMES.get(header, header))
            try:
                of_scene = merged(of_scene, {keys[-1]: _value(table, k, cell)})
            except InputError as error:
                raise InputError(f"{source}, {header} = {cell!r}: {error}") from None
    study, folder = files
    try:
        base.require_not_drawn(keys, of_scene)
        scene = Scene.from_file_tables(of_scene, folder, str(study))
        settings = StudySettings.from_file_tables(tables, scene, study)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
    movement_distribution(at, option=f"{source}: at")
    seed = (settings.study.seed + zlib.crc32(name.encode())) % 2**63
    how = replace(settings.study, seed=seed, samples=samples or settings.study.samples, title=name)
    return replace(settings, study=how), at


def _value(table: NumberTable, column: int, cell: str) -> Any:
    """Value of a cell as in TOML: a number with the unit of its column, a table or list, true or false, or a word."""
    number = re.fullmatch(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?", cell)
    if number:
        plain = cell.replace(",", ".") if table.decimal == "," else cell
        return f"{plain} {unit}" if (unit := table.units[column]) else float(plain)
    if cell[0] in "[{" or cell in ("true", "false"):
        return parse_toml(f"value = {cell}", "the cell")["value"]
    return cell


def _damage(ds: xr.Dataset, house: House, confidence: float) -> dict[str, Any]:
    """Probabilities of the categories of a house at the movement asked for."""
    measure = chosen_intensity(ds, None)
    wanted = _movement(ds, house, measure)
    categories = range(1, int(ds.attrs["highest_category"]) + 1)
    if ds["damage_category"].ndim == 1:  # each wall is known at its own movement alone
        found = [exceedance(ds, category, wanted, confidence=confidence) for category in categories]
    else:  # movements beyond the walls have bounds
        points = wanted_movement(ds, wanted, measure)
        walls = [category_capacities(ds, category, measure, points) for category in categories]
        found = [estimate_exceedance(one, points, confidence) for one in walls]
    return {
        "at": wanted.words,
        "walls": ds.sizes["sample"],
        "failed": int(found[0].failed),
        "measure": movement_words(ds, measure),
        "probability": [one.estimate.value for one in found],
        "probability_lower": [one.estimate.lower for one in found],
        "probability_upper": [one.estimate.upper for one in found],
    }


def _movement(ds: xr.Dataset, house: House, measure: str) -> MovementDistribution:
    """Movement asked for; "site" is the end of the movement if all walls of the house share it."""
    units = str(attributes(ds, measure)["units"])
    wanted = movement_distribution(house.at, units, f"{house.name}: at")
    if wanted.own and not has_own_ground(ds, measure):
        end = float(own_movements(ds, measure).max(initial=0.0))
        return movement_distribution(f"{1e3 * end:.6g} mm" if units == "m" else f"{end:.6g}", units, "at")
    return wanted


def _dataset(table: NumberTable, houses: list[House], rows: list[Mapping[str, Any]], confidence: float) -> xr.Dataset:
    each = ("house", "category")
    unit = {"units": "1"}
    names = ("probability", "probability_lower", "probability_upper")
    columns: dict[str, Any] = {name: (each, np.array([row[name] for row in rows]), unit) for name in names}
    columns |= {name: ("house", [row[name] for row in rows]) for name in ("at", "walls", "failed")}
    for k, name in enumerate(name for name in PLACES if name in table.names):
        columns[name] = ("house", [house.place[k] for house in houses])
    categories = np.arange(1, columns["probability"][1].shape[1] + 1)
    return xr.Dataset(
        columns,
        {"house": [house.name for house in houses], "category": categories},
        {"title": Path(table.path).stem, "confidence": confidence, "measure": rows[0]["measure"]},
    )


def portfolio_frame(street: xr.Dataset) -> Any:
    """Data frame with one row per house: movement, walls, probability of each category or worse with interval."""
    frame = street[[name for name in ("at", "walls", "failed", *PLACES) if name in street]].to_dataframe()
    for category in street["category"].values.tolist():
        for name, ending in (("probability", ""), ("probability_lower", "_lower"), ("probability_upper", "_upper")):
            frame[f"p_category_{category}{ending}"] = street[name].sel(category=category).values
    return frame.rename_axis("name").reset_index()


def write_portfolio(street: xr.Dataset, path: str | Path, crs: str | None = None) -> None:
    """Write one row per house as CSV or GeoPackage (``.gpkg``); eastings and northings need ``crs`` ("EPSG:28354")."""
    frame, path = portfolio_frame(street), Path(path)
    if path.suffix != ".gpkg":
        frame.to_csv(path, index=False)
        return
    geopandas: Any = import_module("geopandas")
    pair = map_columns(frame.columns, path, crs)
    points = geopandas.points_from_xy(frame[pair[0]], frame[pair[1]])
    geopandas.GeoDataFrame(frame, geometry=points, crs=crs or "EPSG:4326").to_file(path, driver="GPKG")


def map_columns(names: Iterable[str], path: Path, crs: str | None) -> tuple[str, str]:
    """Columns of the coordinates for a GeoPackage; refused if they, their system or geopandas are missing."""
    pair = next(((x, y) for x, y in (PLACES[:2], PLACES[2:]) if {x, y} <= set(names)), None)
    if pair is None:
        raise InputError(f"{path}: a GeoPackage needs columns longitude and latitude, or easting and northing.")
    if pair[0] == "easting" and crs is None:
        raise InputError(f"{path}: eastings and northings need their coordinate system, such as --crs EPSG:28354.")
    if find_spec("geopandas") is None:
        raise InputError(f"{path}: needs geopandas; pip install 'damagepred[map]'.")
    return pair
