"""Dataset of a solved path."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.archive.cautions import energy_shares, implausible
from damagepred.archive.provenance import provenance
from damagepred.archive.schema import CATEGORY_VARIABLES, VARIABLES, WORST_CATEGORY, dataset, name_categories
from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import LaboratoryTest
from damagepred.damage import GROUP_COUNTS
from damagepred.damage.judge import Rules, Verdict
from damagepred.diagnostics import Counters, Energies, Residuals, described
from damagepred.enumerations import ContactKind, ZoneState
from damagepred.one_wall.judged_path import Step, gauges
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Damage, Opening, Solver
from damagepred.scene.movement_stage import History
from damagepred.solvers.options import SolverOptions
from damagepred.solvers.system.footing_forces import section_forces, section_interfaces, support_loads


@one_blas_thread()
def path_values(model: Model, steps: list[Step]) -> dict[str, FloatArray]:
    """Variables of whole increments: arrays (increments,), some (increments, openings) or (increments, groups)."""
    joints, lines, frames = gauges(model)
    moved = stacked(steps, "displacement")
    progress = stacked(steps, "load_factor")
    deflection = None if model.deflection is None else np.abs([s.increment.footing.deflection for s in steps])
    motions = [s.increment.motion for s in steps if s.increment.motion is not None]
    values = {
        "progress": progress,
        **movement_values(model, np.abs(progress), deflection),
        **_diagnostics(steps, bool(motions)),
        "base_reaction": stacked(steps, "base_reaction"),
        **(frames.distortion(moved)._asdict() if len(model.jambs.block) else {}),
        **lines.deviation(moved)._asdict(),
        "group_count": np.array(GROUP_COUNTS, dtype=np.int64),
    }
    control = model.interfaces.kind == ContactKind.CONTROL_JOINT
    if control.any():
        for sign, name in ((1.0, "opening"), (-1.0, "closing")):
            widest = [float(joints.widest(sign * s.increment.opening)[control].max()) for s in steps]
            values[f"control_joint_{name}_max"] = np.maximum(widest, 0.0)
    if model.test is not None:
        values |= _test_values(model, model.test, steps)
    elif model.jacks is not None:
        values["jack_load"] = _jack_loads(steps)
    if motions:
        values |= {name: np.array([getattr(m, name) for m in motions]) for name in ("time", "searches")}
        values["base_displacement_x"], values["base_displacement_y"] = np.array([m.base for m in motions]).T
    if model.mesh is not None:
        values |= _zone_counts(steps)
    for name in Verdict._fields:
        values[name] = np.array([getattr(s.verdict, name) for s in steps])
    if model.history is not None:
        values |= history_values(model.history, len(steps))
        values["crack_width_worst"] = np.maximum.accumulate(values["crack_width_max"])
    for name in CATEGORY_VARIABLES:
        values[name] = values[name].astype(np.int8)
    if model.history is not None:
        values[WORST_CATEGORY] = np.maximum.accumulate(values["damage_category"])
    return values


def movement_values(model: Model, progress: FloatArray, deflection: FloatArray | None = None) -> dict[str, FloatArray]:
    """Movement at shares of the full one: of a prescribed form, or by the ``deflection`` of a free footing."""
    values = {}
    if deflection is not None or model.deflection is None:
        values["central_deflection"] = progress * model.central_deflection if deflection is None else deflection
        values["deflection_ratio"] = values["central_deflection"] / model.span
    if model.surface_movement is not None:
        values["surface_movement"] = progress * model.surface_movement
    return values | {name: progress * full for name, full in (model.settlement or {}).items()}


def history_values(history: History, count: int) -> dict[str, FloatArray | IntArray]:
    """Stage, time and strain of the first increments of a history."""
    columns = {name: getattr(history, name) for name in ("stage", "time", "strain")}
    return {name: column[:count] for name, column in columns.items() if column is not None}


def _diagnostics(steps: list[Step], in_time: bool) -> dict[str, FloatArray]:
    """Solver diagnostics of each increment; those of dynamic runs in dynamic runs only."""
    return {
        name: np.array([getattr(getattr(s.increment, of), name) for s in steps])
        for kind, of in ((Residuals, "residuals"), (Counters, "counters"), (Energies, "energy"))
        for name, diagnostic in described(kind).items()
        if in_time or not diagnostic.in_time
    }


def shares_of_size(model: Model, steps: list[Step]) -> dict[str, float]:
    """Largest displacement beyond the ground's and widest crack over the wall's size; NaN for dynamic runs."""
    standing = [s for s in steps if not s.increment.collapsed]
    if not standing or standing[0].increment.motion is not None:
        return dict.fromkeys(("displacement_share", "crack_share"), float("nan"))
    size = max(float(np.ptp(axis)) for axis in model.blocks.vertices.T)
    x, y, _ = np.moveaxis(stacked(standing, "displacement"), -1, 0)
    moved = float(np.sqrt((x**2 + y**2).max()))
    ground = [state.largest() for state in model.ground.states()]
    ground += [float(np.abs(model.supports.prescribed_displacement).max(initial=0.0)), model.central_deflection]
    widest = max(max(s.verdict.crack_width_max, s.verdict.crack_band_width_max) for s in standing)
    return {"displacement_share": max(moved - max(ground), 0.0) / size, "crack_share": float(widest) / size}


def stacked(steps: list[Step], name: str) -> NDArray:
    """One field of all increments: array (increments, ...)."""
    return np.array([getattr(s.increment, name) for s in steps])


def _jack_loads(steps: list[Step]) -> FloatArray:
    """Load of each jack at each increment (N)."""
    return np.array([s.increment.footing.jack_load for s in steps])


def _test_values(model: Model, test: LaboratoryTest, steps: list[Step]) -> dict[str, FloatArray]:
    """Force (N), displacement (m) and gauge opening (m) of a laboratory test, counted from dead load."""
    moved = stacked(steps, "displacement").reshape(len(steps), -1)
    moved = moved - moved[0]
    force = stacked(steps, "load_factor") * test.force
    if model.jacks is not None:
        force = _jack_loads(steps)
        force[0] = 0.0
        force[[step.increment.collapsed for step in steps]] = np.nan  # in motion
    values = {"load_force": force, "load_displacement": moved @ test.push}
    if test.gauge is not None:
        values["gauge_opening"] = moved @ test.gauge
    return values


def _footing_values(model: Model, steps: list[Step]) -> dict[str, FloatArray]:
    """Section forces and support loads of a footing of the model."""
    values: dict[str, FloatArray] = {}
    if model.footing is None:
        return values
    section = section_interfaces(model)
    if section.size:
        forces = section_forces(model, *(stacked(steps, n) for n in ("opening", "normal_stress", "shear_stress")))
        values["section_x"] = model.interfaces.x[section]
        values |= {f"section_{name}": getattr(forces, name) for name in forces._fields}
    if model.jacks is not None:
        support_x, load = support_loads(model, stacked(steps, "normal_stress"))
        values |= {"support_x": support_x, "support_load": load, "jack_x": model.jacks.at}
    return values


def ending_attributes(model: Model, last: Step) -> dict[str, object]:
    """Limit at which a path with jacks ended early, as attributes."""
    ended = last.increment.end.unloaded
    if not ended or model.jacks is None:
        return {}
    if model.test is not None:
        return {"limit": "loads", "status_message": "the load has fallen to nothing"}
    deflection = abs(last.increment.footing.deflection)
    carrier = "the jacks carry" if ended == "jacks" else "an outer support carries"
    message = f"{carrier} nothing any more at a deflection of {1e3 * deflection:.3g} mm"
    return {"limit": ended, "limit_deflection": deflection, "status_message": message}


def _zone_counts(steps: list[Step]) -> dict[str, NDArray]:
    """Number of yielding zones by kind: arrays (increments,)."""
    kinds = {
        "zones_in_shear": (ZoneState.SHEAR, ZoneState.SHEAR_AND_TENSION),
        "zones_in_tension": (ZoneState.TENSION, ZoneState.SHEAR_AND_TENSION),
        "zones_yielded_before": (ZoneState.YIELDED,),
    }
    pictures = [s.increment.zones for s in steps]
    return {
        name: np.array([0 if p is None else np.isin(p.state, states).sum() for p in pictures], dtype=np.int64)
        for name, states in kinds.items()
    }


def _zone_values(model: Model, steps: list[Step]) -> dict[str, NDArray]:
    """Stress, state and gridpoints of zones."""
    mesh = model.mesh
    pictures = [s.increment.zones for s in steps if s.increment.zones is not None]
    if mesh is None or len(pictures) < len(steps):
        return {}
    # one component at a time: the largest arrays are not copied as a whole
    moved = {
        f"gridpoint_displacement_{axis}": np.array([p.displacement[:, i] for p in pictures])
        for i, axis in enumerate("xy")
    }
    stress = {
        f"zone_stress_{name}": np.array([p.stress[:, i] for p in pictures])
        for i, name in enumerate(("xx", "yy", "xy", "zz"))
    }
    return {
        "zone_mesh": np.array(0, dtype=np.int32),
        "gridpoint_x": mesh.x,
        "gridpoint_y": mesh.y,
        "gridpoint_block": mesh.gridpoint_block,
        "zone_gridpoint": mesh.zones.astype(np.int32),
        "zone_block": mesh.zone_block,
        **moved,
        **stress,
        "zone_state": np.array([p.state for p in pictures]),
    }


def _registered(
    dims: tuple[str, ...], record: Mapping[str, Any], value: Callable[[str], NDArray] | None = None
) -> dict[str, NDArray]:
    """Variables of the schema with these dimensions whose names, without the last dimension's, have a value."""
    short = {name: name.removeprefix(f"{dims[-1]}_") for name, kind in VARIABLES.items() if kind.dims == dims}
    return {name: record[key] if value is None else value(key) for name, key in short.items() if key in record}


def collect(
    model: Model,
    steps: list[Step],
    damage: Damage,
    settings: Solver,
    attributes: Mapping[str, object],
    store_zones: bool,
    openings: Sequence[Opening] = (),
) -> xr.Dataset:
    """Dataset of a path: blocks, contacts, increments and attributes; the size of openings is of a scene alone."""
    blocks, face, joints = model.blocks, model.interfaces, gauges(model).joints
    holes: Sequence[Opening | None] = openings or [None] * len(model.jambs.block)
    rules = Rules.from_settings(**asdict(damage))
    sides = {"left": "x", "sill": "y", "width": "width", "height": "height"} if holes else {}

    def at_contacts(name: str) -> NDArray:
        values = np.asarray(contacts[name])
        return np.repeat(values, face.contact_area.shape[1]) if values.ndim == 1 else values.ravel()

    def along_path(name: str) -> NDArray:
        return stacked(steps, name).reshape(len(steps), -1)

    moved = stacked(steps, "displacement")
    unknown = np.full_like(moved[0], np.nan)
    support = np.array([unknown if s.increment.support_force is None else s.increment.support_force for s in steps])
    strains = [s.increment.strain for s in steps if s.increment.strain is not None]
    elastic = {}
    if len(strains) == len(steps):  # strain and curvature of elastic blocks, arrays (increments, blocks)
        elastic = dict(zip(("block_strain", "block_curvature"), np.moveaxis(np.array(strains), 2, 0)))
    corners = {"block": np.repeat(np.arange(model.n_blocks), np.diff(blocks.first_vertex))}
    corners |= dict(zip("xy", blocks.vertices.T))
    contacts = face._asdict() | model.properties._asdict()
    contacts |= {"x": joints.contact_x, "y": joints.contact_y, "length": joints.contact_length}
    contacts |= {"thickness": face.contact_area / joints.contact_length, "interface": np.arange(len(face.kind))}
    if (broken_at := steps[-1].increment.broken_at) is not None:
        contacts["broken_at"] = broken_at
    values = {
        "increment": stacked(steps, "number").astype(np.int64),
        **path_values(model, steps),
        **{f"opening_{side}": np.array([getattr(h, key, np.nan) for h in holes]) for side, key in sides.items()},
        **_registered(("block",), blocks._asdict()),
        **dict(zip(("block_displacement_x", "block_displacement_y", "block_rotation"), np.moveaxis(moved, 2, 0))),
        **elastic,
        **dict(zip((f"block_support_{name}" for name in ("force_x", "force_y", "moment")), np.moveaxis(support, 2, 0))),
        **_registered(("vertex",), corners),
        **_registered(("contact",), contacts, at_contacts),
        **_registered(("increment", "contact"), vars(steps[0].increment), along_path),
        **_footing_values(model, steps),
        **(_zone_values(model, steps) if store_zones else {}),
    }
    whole: dict[str, object] = {**attributes, **provenance(), "solver_options": SolverOptions.of(settings).to_json()}
    whole |= {"damage_table": rules.table.name, "damage_measure": rules.measure}
    whole |= {"count_footing_gap": rules.count_footing_gap, "apex_limited_joints": model.apex_limited}
    whole["snap_back_limited_joints"] = model.snap_back_limited
    whole |= {name: getattr(model, name) for name in ("span", "thickness", "mean_block_weight")}
    if (mesh := model.mesh) is not None:
        whole |= {"deformable_blocks": len(mesh.block), "zones": len(mesh.zones), "plane": model.plane}
    ds = dataset(values, whole)
    shares_of_wall = energy_shares(values) | shares_of_size(model, steps)
    ds.attrs |= {name: share for name, share in shares_of_wall.items() if np.isfinite(share)}
    ds.attrs["implausible"] = int(implausible(ds.attrs, settings))
    for name, more in rules.attributes().items():
        ds[name].attrs.update(more)
    name_categories(ds, rules.table.category_names, f"{rules.table.name}; {rules.table.source}")
    return ds
