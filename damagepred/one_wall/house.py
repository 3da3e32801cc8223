"""Path of a house, judged wall by wall, its values and its dataset."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import xarray as xr

from damagepred.archive.schema import dataset, name_categories, wall_attributes
from damagepred.arrays import FloatArray
from damagepred.assembly.house import HouseModel
from damagepred.assembly.model import Model
from damagepred.damage.judge import Rules, Verdict
from damagepred.one_wall.dataset import collect, path_values
from damagepred.one_wall.judged_path import Step, follow_wall, gauges, judged, model_of
from damagepred.results.house import of_all_walls
from damagepred.runtime.one_thread import each_with_one_blas_thread, one_blas_thread
from damagepred.scene import Damage, House, Scene, Solver
from damagepred.solvers import Increment, solve_path


@each_with_one_blas_thread
def follow_scene(
    scene: Scene, fields: Mapping[str, FloatArray] | None, increments: int
) -> Iterator[tuple[Model, Step]]:
    """Solve the static path of a wall or house; yield each increment, with the model and the damage of each wall."""
    if not isinstance(scene, House):
        yield from follow_wall(scene, fields, increments)
        return
    model = model_of(scene, fields)
    assert isinstance(model, HouseModel)
    places, rules = [gauges(wall) for wall in model.walls], Rules.from_settings(**asdict(scene.damage))
    for increment in solve_path(model, scene.solver, increments):
        farthest = np.hypot(*increment.displacement[:, :2].T).argmax()
        fallen = np.searchsorted(model.unfolded.first_block, farthest, side="right") - 1 if increment.collapsed else -1
        parts = [replace(of_wall(model, increment, w), collapsed=w == fallen) for w in range(len(places))]
        walls = tuple(judged(place, part, rules) for place, part in zip(places, parts))
        yield model, Step(increment, _worst([step.verdict for step in walls]), walls)


def of_wall(model: HouseModel, increment: Increment, number: int) -> Increment:
    """Increment of one wall; diagnostics and energies are of the whole house."""
    blocks, rows = slice(*model.unfolded.first_block[number : number + 2]), model.unfolded.rows[number]
    fields: dict[str, Any] = {
        name: None if (values := getattr(increment, name)) is None else values[blocks]
        for name in ("displacement", "strain", "support_force")
    }
    contacts = ("opening", "slip", "normal_stress", "shear_stress", "state", "broken_at")
    for name in contacts:
        fields[name] = None if (values := getattr(increment, name)) is None else values[rows]
    wall, moved = model.walls[number], fields["displacement"].ravel()
    if wall.deflection is not None:  # of the segments of the footing, which are rigid
        fields["footing"] = increment.footing._replace(deflection=float(wall.deflection[: moved.size] @ moved))
    fields["base_reaction"] = -float((wall.interfaces.contact_area * fields["normal_stress"])[wall.on_ground].sum())
    return replace(increment, **fields)


def _worst(verdicts: Sequence[Verdict]) -> Verdict:
    """Largest values of all walls."""
    groups = tuple(map(max, zip(*(v.crack_group_width for v in verdicts))))
    largest = {name: max(getattr(v, name) for v in verdicts) for name in Verdict._fields}
    return Verdict(**(largest | {"crack_group_width": groups}))


@one_blas_thread()
def collect_house(
    house: House,
    model: HouseModel,
    steps: Sequence[Step],
    damage: Damage,
    settings: Solver,
    attributes: Mapping[str, object],
) -> xr.Dataset:
    """Dataset of a house: blocks and contacts of all walls, results of each wall, corners."""
    parts = []
    for number, (wall, scene) in enumerate(zip(model.walls, house.scenes)):
        steps_of_wall = [s.walls[number] for s in steps]
        parts.append(collect(wall, steps_of_wall, damage, settings, attributes, False, scene.opening))
    values = of_all_walls([{str(name): v.values for name, v in part.variables.items()} for part in parts])
    _number_on(values, "vertex_block", "vertex_wall", [m.n_blocks for m in model.walls])
    _number_on(values, "contact_interface", "contact_wall", [len(m.interfaces.kind) for m in model.walls])
    _number_on(values, "contact_joint", "contact_wall", [len(m.joints.kind) for m in model.walls])
    values |= _plan(house) | _corner_values(model, steps, len(house.junctions))
    ds = dataset(values, {**parts[0].attrs, "span": model.span, "mean_block_weight": model.mean_block_weight})
    for name in ("displacement_share", "crack_share", "implausible"):
        if name in ds.attrs:
            ds.attrs[name] = max(part.attrs[name] for part in parts)
    for name, count in (("apex", model.apex_limited), ("snap_back", model.snap_back_limited)):
        ds.attrs[f"{name}_limited_joints"] = count
    for shared in ds.variables.keys() & parts[0].variables.keys():
        ds[shared].attrs.update(parts[0][shared].attrs)
    ds["wall"].attrs = wall_attributes(house.names)
    table = Rules.from_settings(**asdict(damage)).table
    name_categories(ds, table.category_names, f"{table.name}; {table.source}")
    return ds


def house_values(model: HouseModel, steps: Sequence[Step]) -> dict[str, Any]:
    """Variables of whole increments: of each wall, and of the house by its worst wall; see ``path_values``."""
    parts = [path_values(wall, [s.walls[number] for s in steps]) for number, wall in enumerate(model.walls)]
    return of_all_walls(parts) | {"wall": np.arange(len(parts), dtype=np.int8)}


def _number_on(values: dict[str, Any], name: str, wall: str, counts: Sequence[int]) -> None:
    """Number blocks, interfaces or joints on from wall to wall."""
    values[name] = values[name] + np.concatenate(([0], np.cumsum(counts)))[values[wall]]


def _plan(house: House) -> dict[str, Any]:
    """Names and ends of the walls, and the corners."""
    ends = {
        f"wall_{side}_{axis}": np.array([getattr(wall, side)[i] for wall in house.wall])
        for side in ("start", "end")
        for i, axis in enumerate("xy")
    }
    points = np.array([j.point for j in house.junctions]).reshape(-1, 2)
    pairs = np.array([j.walls for j in house.junctions], dtype=np.int64).reshape(-1, 2)
    corners = {"corner_x": points[:, 0], "corner_y": points[:, 1]}
    numbers = {"corner_first_wall": pairs[:, 0], "corner_second_wall": pairs[:, 1]}
    return {"wall": np.arange(len(house.wall), dtype=np.int8), **ends, **corners, **numbers}


def _corner_values(model: HouseModel, steps: Sequence[Step], count: int) -> dict[str, FloatArray]:
    """Vertical shear and slip at the corners."""
    rows, pairs = model.unfolded.corner_rows, model.unfolded.corners
    area = model.interfaces.contact_area[rows]
    forces, slips = [], []
    for step in steps:
        force = (step.increment.shear_stress[rows] * area).sum(axis=1)
        slip = np.abs(step.increment.slip[rows]).max(axis=1)
        forces.append([np.bincount(pairs.junction, force * on, count) for on in (~pairs.on_footing, pairs.on_footing)])
        largest = np.zeros(count)
        np.maximum.at(largest, pairs.junction, np.where(pairs.on_footing, 0.0, slip))
        slips.append(largest)
    masonry, footing = np.moveaxis(np.array(forces), 1, 0)
    return {"corner_shear_force": masonry, "corner_footing_force": footing, "corner_slip_max": np.array(slips)}
