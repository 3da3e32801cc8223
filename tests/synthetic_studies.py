"""Study folders with synthetic results, without solving walls."""

import tomllib
from collections.abc import Collection
from dataclasses import asdict
from pathlib import Path

import numpy as np
import xarray as xr

from damagepred.archive.files import write_dataset
from damagepred.archive.folder import StudyFolder
from damagepred.archive.parts import study_dims
from damagepred.archive.schema import VARIABLES, dataset, name_categories
from damagepred.campaign.settings import StudySettings
from damagepred.damage.judge import Rules
from damagepred.enumerations import SampleStatus
from damagepred.study import Study
from damagepred.uq.capacity import Capacities, read_capacities
from tests.conftest import SMALL_STUDY

COMPLETE, COLLAPSED, FAILED, MISSING = SampleStatus


def capacities(ds: xr.Dataset, category: int, intensity: str = "central_deflection") -> Capacities:
    """Capacity of each wall for one category."""
    read = read_capacities(ds, [category], intensity).capacities
    return Capacities(read.lower[0], read.upper[0], read.failed[0], read.end)


def synthetic_study(
    folder: Path,
    walls: int = 24,
    medians: tuple[float, ...] = (1.5e-3, 3.5e-3),
    dispersion: float = 0.4,
    failed: Collection[int] = (),
    missing: Collection[int] = (),
    changes: str = "",
    own_movements: bool = True,
) -> Path:
    """Make a study of which walls reach category 1, 2, ... at lognormal movements (m) that belong together."""
    settings = StudySettings.from_dict(tomllib.loads(SMALL_STUDY + changes))
    study = Study(settings)
    place = StudyFolder(folder)
    place.create(settings.to_toml(), study._manifest(walls), study.design_dataset(walls))
    random = np.random.default_rng(1)
    steps = settings.scene.movement.increments
    end = study.design.wall_values(walls)["movement.central_deflection"]
    if not own_movements:
        end = np.full(walls, settings.scene.movement.central_deflection)
    movement = np.arange(steps + 1) / steps * end[:, None]
    strength = np.exp(dispersion * random.standard_normal(walls))
    capacity = np.array(medians) * strength[:, None]
    category = (movement[:, :, None] >= capacity[:, None, :]).sum(axis=2).astype(np.int8)
    width = 2e-3 * (movement / strength[:, None] / medians[-1]) ** 2
    status = np.full(walls, COMPLETE, dtype=np.int8)
    status[list(failed)], status[list(missing)] = FAILED, MISSING
    category[status >= FAILED, 1:] = -1
    category[status == MISSING] = -1
    nothing = np.where(category < 0, np.nan, 0.0)
    table = settings.damage_table
    by_band = np.where(category < 0, category, np.maximum(category, table.by_width(1.5 * width))).astype(np.int8)
    values = (
        {"status": status, "central_deflection": movement}
        | {"deflection_ratio": movement / settings.scene.wall.length, "damage_category": category}
        | {"crack_width_max": width + nothing, "dpc_opening_max": nothing, "damage_category_band": by_band}
        | {"crack_band_width_max": 1.5 * width + nothing, "footing_opening_max": 0.9 * movement + nothing}
        | {"footing_separation_length": nothing, "dpc_separation_length": nothing, "crack_count": 2 + nothing}
        | {"base_crack_width_max": nothing, "base_reaction": 9000.0 + nothing}
        | {"unbalanced_force_ratio": 1e-9 + nothing, "joint_law_violation": 1e-6 + nothing}
        | {"external_work": 5.0 + nothing, "elastic_energy": 2.0 + nothing, "friction_work": 1.0 + nothing}
        | {"fracture_work": nothing, "released_energy": 2.0 + nothing, "energy_error": 1e-7 + nothing}
        | {"run_time": np.full(walls, 0.25)}
    )
    ds = dataset({"sample": np.arange(walls), **values}, {}, {name: study_dims(name) for name in values})
    name_categories(ds, table.category_names, f"{table.name}; {table.source}")
    for name, more in Rules.from_settings(**asdict(settings.scene.damage)).attributes().items():
        if name in ds:
            ds[name].attrs.update(more)
    assert set(values) <= set(VARIABLES)
    write_dataset(ds, place.results_file, place.study_hash)
    for sample in failed:
        place.record_failure(sample, "not_converged", "no equilibrium in increment 1", {"joint.friction": 0.7})
    return folder
