"""Archive variables: name, dimensions, unit and meaning. The only list, used by writers and readers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from damagepred.diagnostics import Counters, Energies, Residuals, described
from damagepred.enumerations import ContactKind, ContactState, SampleStatus, ZoneState, flag_meanings

SCHEMA_VERSION = 9
"""Increases when names, meanings or files change; ``damagepred.archive.versions`` reads all versions."""


@dataclass(frozen=True)
class Variable:
    """Variable of an archive."""

    dims: tuple[str, ...]  # in a wall's file; in a study, "sample" comes first
    units: str | None  # UDUNITS; None for flags
    long_name: str  # meaning and sign
    flags: tuple[str, ...] = ()  # meanings of the values 0, 1, ...
    standard_name: str | None = None  # of CF
    mesh: Mapping[str, Any] = field(default_factory=dict)  # attributes of UGRID
    on_disk: str | None = None  # shorter type in files: stresses need no sixteen digits

    def attributes(self) -> dict[str, Any]:
        """CF attributes."""
        attrs: dict[str, Any] = {"long_name": self.long_name}
        if self.units is not None:
            attrs["units"] = self.units
        if self.standard_name:
            attrs["standard_name"] = self.standard_name
        if self.flags:
            values = np.arange(len(self.flags), dtype=np.int8)
            # valid_range instead of _FillValue, for which xarray would convert flags to floats
            attrs |= {"flag_values": values, "flag_meanings": " ".join(self.flags), "valid_range": values[[0, -1]]}
        return attrs | dict(self.mesh)


_STEP, _SAMPLE = ("increment",), ("sample",)
_BLOCK, _CONTACT, _OPENING, _VERTEX = ("block",), ("contact",), ("opening",), ("vertex",)
_SECTION, _ZONE, _GRIDPOINT = ("section",), ("zone",), ("gridpoint",)
_BLOCKS, _CONTACTS, _OPENINGS = (*_STEP, *_BLOCK), (*_STEP, *_CONTACT), (*_STEP, *_OPENING)
_SECTIONS, _ZONES, _GRIDPOINTS = (*_STEP, *_SECTION), (*_STEP, *_ZONE), (*_STEP, *_GRIDPOINT)
"""Dimensions of variables; the plural ones are at each increment."""

MESH = "zone_mesh"
"""Variable with the topology of zones and gridpoints (UGRID)."""
_ON_ZONES, _ON_GRIDPOINTS = {"mesh": MESH, "location": "face"}, {"mesh": MESH, "location": "node"}

GROWING_GROUND = {"ground_states": "ground profile evaluated at the current surface movement"}
"""Attribute of ``surface_movement``; older archives lack it."""
MOVEMENTS = (
    *("surface_movement", "settlement", "differential_settlement"),
    *("angular_distortion", "ground_tilt", "horizontal_strain"),
)
"""Measures of the ground's movement, coordinates of a path."""
CATEGORIES = ("negligible", "very_slight", "slight", "moderate", "severe", "very_severe")
CATEGORY_VARIABLES = ("damage_category", "damage_category_band")
"""Category by the chosen measure, and by the width of the widest crack band."""
WORST_CATEGORY = "damage_category_worst"
"""Largest category to date in a history."""

VARIABLES: dict[str, Variable] = {
    # the path
    "increment": Variable(_STEP, "1", "increment of the movement, 0 is dead load alone"),
    "progress": Variable(_STEP, "1", "share of the full movement, and of the live load at full movement"),
    "stage": Variable(_STEP, "1", "stage of a movement in stages, from 1; 0 is dead load alone"),
    "central_deflection": Variable(_STEP, "m", "deflection of the footing's centre relative to its ends, not negative"),
    "deflection_ratio": Variable(
        _STEP,
        "1",
        "central deflection, of a settlement the largest from the line through the ends, over the length between them",
    ),
    "strain": Variable(_STEP, "1", "of a history: free strain of the bricks"),
    "surface_movement": Variable(_STEP, "m", "characteristic surface movement, by which a site is classed"),
    "settlement": Variable(_STEP, "m", "settlement of the ground, by movement.settlement_is"),
    "differential_settlement": Variable(_STEP, "m", "height of the highest ground under the wall over the lowest"),
    "angular_distortion": Variable(
        _STEP, "1", "largest slope of the ground over one brick, relative to the line through the ends"
    ),
    "ground_tilt": Variable(_STEP, "1", "slope of the line through the ends of the ground, not negative"),
    "horizontal_strain": Variable(_STEP, "1", "largest strain of the ground along the wall over one brick"),
    "movement": Variable(
        _STEP, "m", "of a study: surface_movement, settlement or central_deflection, where all samples have the same"
    ),
    "load_force": Variable(_STEP, "N", "load of all strips of a laboratory test together, in their directions"),
    "load_displacement": Variable(_STEP, "m", "displacement of these strips in their directions, after the dead load"),
    "gauge_opening": Variable(_STEP, "m", "opening of the gauge of a laboratory test, after the dead load"),
    "jack_load": Variable(_STEP, "N", "load of each jack under the footing, upwards positive"),
    **{
        name: Variable(_STEP, diagnostic.units, diagnostic.meaning)
        for record in (Residuals, Counters, Energies)
        for name, diagnostic in described(record).items()
    },
    "time": Variable(_STEP, "s", "physical time of a dynamic run; of a movement in stages years since the dead load"),
    "base_displacement_x": Variable(_STEP, "m", "displacement of the base along the wall in a dynamic run"),
    "base_displacement_y": Variable(_STEP, "m", "displacement of the base upwards in a dynamic run"),
    "searches": Variable(_STEP, "1", "cumulative searches for neighbouring blocks, of a dynamic run"),
    "base_reaction": Variable(_STEP, "N", "vertical force of the ground on the wall, upwards positive"),
    # the verdict
    "damage_category": Variable(_STEP, None, "damage category of the wall proper, above any dpc", CATEGORIES),
    "damage_category_band": Variable(
        _STEP, None, "damage category of the wall proper by its widest crack band", CATEGORIES
    ),
    "crack_width_max": Variable(_STEP, "m", "widest single joint of the wall proper, above any dpc"),
    "crack_width_worst": Variable(
        _STEP, "m", "of a movement in stages: largest crack_width_max to date, also after cracks close"
    ),
    "damage_category_worst": Variable(
        _STEP, None, "of a movement in stages: largest damage_category to date, also after cracks close", CATEGORIES
    ),
    "crack_band_width_max": Variable(
        _STEP, "m", "widest crack band of the wall proper: openings of neighbouring joints along gauge_length, summed"
    ),
    "crack_count": Variable(_STEP, "1", "separate cracks of the wall proper of least_width or more"),
    "crack_length_total": Variable(_STEP, "m", "length of all cracks of the wall proper together"),
    "psi": Variable(
        _STEP, "1", "damage parameter Psi = 2 n^0.15 c^0.3 of the wall proper: n cracks of c mm, weighted by width"
    ),
    "group_count": Variable(("group_count",), "1", "number of cracks that make a group"),
    "crack_group_width": Variable(
        (*_STEP, "group_count"),
        "m",
        "largest width reached by group_count cracks of the wall proper in one group, or 0",
    ),
    "base_crack_width_max": Variable(_STEP, "m", "widest crack in the courses below the dpc"),
    "dpc_opening_max": Variable(_STEP, "m", "widest opening of the damp-proof course"),
    "dpc_separation_length": Variable(_STEP, "m", "length over which the dpc is open by more than opening_threshold"),
    "dpc_slip_max": Variable(_STEP, "m", "largest slip of the damp-proof course, either way"),
    "footing_opening_max": Variable(_STEP, "m", "widest gap along the bed between first course and footing"),
    "footing_separation_length": Variable(
        _STEP, "m", "length over which the bed on the footing is open by more than opening_threshold"
    ),
    "tilt_max": Variable(_STEP, "1", "largest deviation of the wall proper from plumb, over about a metre"),
    "slope_max": Variable(_STEP, "1", "largest deviation of courses of the wall proper from level, over about a metre"),
    "base_slope_max": Variable(_STEP, "1", "largest deviation of the lowest course from level, over about a metre"),
    "control_joint_opening_max": Variable(_STEP, "m", "largest widening of a control joint"),
    "control_joint_closing_max": Variable(_STEP, "m", "largest closing of a control joint"),
    "deviation_level": Variable(
        _STEP,
        None,
        "visibility of the deviation of the wall proper from level or plumb, judged again",
        ("not_noticeable", "undesirable", "clearly_visible"),
    ),
    # openings
    "opening_left": Variable(_OPENING, "m", "left edge of the opening"),
    "opening_sill": Variable(_OPENING, "m", "height of the opening's sill"),
    "opening_width": Variable(_OPENING, "m", "width of the opening"),
    "opening_height": Variable(_OPENING, "m", "height of the opening"),
    "opening_width_change": Variable(
        _OPENINGS, "m", "change of the width at the upper end of the jambs, widening positive"
    ),
    "opening_distortion": Variable(
        _OPENINGS, "1", "largest absolute change of the right angle at a corner of the opening, in radians"
    ),
    "opening_sticking": Variable(
        _OPENINGS,
        None,
        "whether a door or window in the opening sticks, judged again",
        ("free", "sticks_slightly", "sticks"),
    ),
    "opening_diagonal_change": Variable(
        _OPENINGS, "m", "change of length of the diagonal that has shortened most, lengthening positive"
    ),
    # the footing
    "support_x": Variable(("support",), "m", "position of the support along the wall"),
    "support_load": Variable((*_STEP, "support"), "N", "load that the support carries, upwards positive"),
    "jack_x": Variable(("jack",), "m", "position of the jack along the wall"),
    "section_x": Variable(_SECTION, "m", "position of the footing's section along the wall"),
    "section_strain": Variable(_SECTIONS, "1", "strain of the section at mid-depth, elongation positive"),
    "section_curvature": Variable(_SECTIONS, "m-1", "curvature of the footing, sagging positive"),
    "section_axial_force": Variable(_SECTIONS, "N", "axial force in the footing, tension positive"),
    "section_shear_force": Variable(_SECTIONS, "N", "shear force: upward force of the left part on the right"),
    "section_moment": Variable(_SECTIONS, "N m", "moment in the footing, sagging positive: tension below"),
    # blocks
    "block_x": Variable(_BLOCK, "m", "centroid of the block along the wall"),
    "block_y": Variable(_BLOCK, "m", "height of the block's centroid"),
    "block_course": Variable(_BLOCK, "1", "course of the block, 0 at the bottom, -1 where there are none"),
    "block_displacement_x": Variable(_BLOCKS, "m", "displacement of the block along the wall, relative to the base"),
    "block_displacement_y": Variable(_BLOCKS, "m", "displacement of the block upwards, relative to the base"),
    "block_rotation": Variable(_BLOCKS, "rad", "rotation of the block, counter-clockwise positive"),
    "block_strain": Variable(_BLOCKS, "1", "strain of an elastic block along its bed, elongation positive"),
    "block_curvature": Variable(
        _BLOCKS, "m-1", "curvature of an elastic block, positive where its ends go up against its middle"
    ),
    "block_support_force_x": Variable(_BLOCKS, "N", "force of the block's supports, along the wall"),
    "block_support_force_y": Variable(_BLOCKS, "N", "force of the block's supports, upwards"),
    "block_support_moment": Variable(_BLOCKS, "N m", "moment of the block's supports, counter-clockwise"),
    "vertex_x": Variable(_VERTEX, "m", "corner of a block along the wall"),
    "vertex_y": Variable(_VERTEX, "m", "height of a block's corner"),
    "vertex_block": Variable(_VERTEX, "1", "block the corner belongs to; corners are counter-clockwise"),
    # contacts
    "contact_x": Variable(_CONTACT, "m", "position of the contact along the wall"),
    "contact_y": Variable(_CONTACT, "m", "height of the contact"),
    "contact_kind": Variable(_CONTACT, None, "kind of joint", flag_meanings(ContactKind)),
    "contact_interface": Variable(_CONTACT, "1", "interface, the common edge of two blocks, that the contact lies on"),
    "contact_joint": Variable(_CONTACT, "1", "mortar joint the contact belongs to"),
    "contact_length": Variable(_CONTACT, "m", "length of joint the contact stands for"),
    "contact_thickness": Variable(_CONTACT, "m", "thickness of the joint: the lesser of the blocks beside it"),
    "contact_normal_x": Variable(_CONTACT, "1", "unit normal of the joint, along the wall"),
    "contact_normal_y": Variable(_CONTACT, "1", "unit normal of the joint, upwards"),
    "contact_tensile_strength": Variable(_CONTACT, "Pa", "tensile strength in effect"),
    "contact_cohesion": Variable(_CONTACT, "Pa", "cohesion"),
    "contact_friction": Variable(_CONTACT, "1", "tangent of the friction angle"),
    "contact_opening": Variable(_CONTACTS, "m", "relative displacement normal to the joint, opening positive"),
    "contact_slip": Variable(_CONTACTS, "m", "plastic slip along the joint"),
    "contact_normal_stress": Variable(_CONTACTS, "Pa", "normal stress, tension positive"),
    "contact_shear_stress": Variable(_CONTACTS, "Pa", "shear stress"),
    "contact_state": Variable(_CONTACTS, None, "state of the contact", flag_meanings(ContactState)),
    "contact_broken_at": Variable(
        _CONTACT, "1", "share of the full movement at which the bond broke, NaN where it holds or was absent"
    ),
    # deformable blocks
    "zones_in_shear": Variable(_STEP, "1", "zones that yield in shear"),
    "zones_in_tension": Variable(_STEP, "1", "zones that yield in tension"),
    "zones_yielded_before": Variable(_STEP, "1", "zones that are elastic, but have yielded before"),
    MESH: Variable(
        (),
        None,
        "zones of the deformable blocks; blocks share no gridpoints",
        mesh={
            "cf_role": "mesh_topology",
            "topology_dimension": np.int32(2),
            "face_dimension": "zone",
            "node_coordinates": "gridpoint_x gridpoint_y",
            "face_node_connectivity": "zone_gridpoint",
        },
    ),
    "zone_gridpoint": Variable(
        ("zone", "zone_corner"),
        "1",
        "gridpoints of the zone, counter-clockwise",
        mesh={"cf_role": "face_node_connectivity", "start_index": np.int32(0)},
    ),
    "zone_block": Variable(_ZONE, "1", "block the zone belongs to", mesh=_ON_ZONES),
    "gridpoint_block": Variable(_GRIDPOINT, "1", "block the gridpoint belongs to", mesh=_ON_GRIDPOINTS),
    "gridpoint_x": Variable(_GRIDPOINT, "m", "position of the gridpoint along the wall"),
    "gridpoint_y": Variable(_GRIDPOINT, "m", "height of the gridpoint"),
    "gridpoint_displacement_x": Variable(
        _GRIDPOINTS, "m", "displacement of the gridpoint along the wall", mesh=_ON_GRIDPOINTS
    ),
    "gridpoint_displacement_y": Variable(
        _GRIDPOINTS, "m", "displacement of the gridpoint upwards", mesh=_ON_GRIDPOINTS
    ),
    "zone_stress_xx": Variable(
        _ZONES, "Pa", "normal stress along the wall, tension positive", mesh=_ON_ZONES, on_disk="float32"
    ),
    "zone_stress_yy": Variable(
        _ZONES, "Pa", "upright normal stress, tension positive", mesh=_ON_ZONES, on_disk="float32"
    ),
    "zone_stress_xy": Variable(_ZONES, "Pa", "shear stress in the wall's plane", mesh=_ON_ZONES, on_disk="float32"),
    "zone_stress_zz": Variable(
        _ZONES, "Pa", "normal stress across the wall, tension positive", mesh=_ON_ZONES, on_disk="float32"
    ),
    "zone_state": Variable(_ZONES, None, "yield state of the zone", flag_meanings(ZoneState), mesh=_ON_ZONES),
    # a study
    "sample": Variable(_SAMPLE, "1", "sampled wall", standard_name="realization"),
    "status": Variable(_SAMPLE, None, "how the sample ended", flag_meanings(SampleStatus)),
    "limit_deflection": Variable(
        _SAMPLE, "m", "deflection at which jacks or supports carried no load any more; NaN if the path went on"
    ),
    "weight": Variable(
        _SAMPLE, "1", "weight of the sample: density of the stated distributions over the sampling density"
    ),
    "run_time": Variable(_SAMPLE, "s", "time spent on the sample"),
    "environment": Variable(
        _SAMPLE,
        "1",
        "machine, program and libraries that solved the sample: row of the table in the attribute environments",
    ),
    "energy_error_share": Variable(
        _SAMPLE, "1", "largest energy that does not balance over the largest work done; NaN where it is not counted"
    ),
    "snap_through_share": Variable(
        _SAMPLE, "1", "energy set free in snap-through over the largest work done; NaN where it is not counted"
    ),
    "displacement_share": Variable(
        _SAMPLE, "1", "largest displacement of a block beyond the ground's over the size of the wall"
    ),
    "crack_share": Variable(_SAMPLE, "1", "widest crack over the size of the wall"),
    "implausible": Variable(
        _SAMPLE, None, "whether energy error, displacement or crack exceeds its tolerance", ("no", "yes")
    ),
    "snap_back_limited": Variable(
        _SAMPLE, "1", "joints with less fracture energy than elastic energy at cracking: their bond breaks at once"
    ),
    "apex_limited": Variable(_SAMPLE, "1", "joints whose tensile strength was cut to cohesion over friction"),
}

BY_WALL = (
    *CATEGORY_VARIABLES,
    *("crack_width_max", "crack_width_worst", WORST_CATEGORY, "crack_band_width_max", "crack_count"),
    *("crack_length_total", "psi"),
    *("base_crack_width_max", "dpc_opening_max", "dpc_separation_length", "dpc_slip_max", "footing_opening_max"),
    *("footing_separation_length", "tilt_max", "slope_max", "base_slope_max", "central_deflection"),
    *("deflection_ratio", "base_reaction", "control_joint_opening_max", "control_joint_closing_max", "deviation_level"),
    "crack_group_width",
)
"""Results that a house has for each wall, as ``wall_<name>``; ``<name>`` is the largest of all walls."""
OF_HOUSE = {
    "wall": Variable(("wall",), "1", "wall of a house, a flag whose meanings are the names of the walls"),
    **{
        f"wall_{side}_{axis}": Variable(("wall",), "m", f"{side} of the wall's axis in plan, {axis}")
        for side in ("start", "end")
        for axis in "xy"
    },
    **{
        f"{place}_wall": Variable((place,), "1", f"number of the wall of the {place}, from 0")
        for place in ("block", "contact", "vertex", "opening", "section")
    },
    "damaged_walls": Variable(_STEP, "1", "number of walls of damage category 1 or more"),
    "corner_x": Variable(("corner",), "m", "place in plan where two walls meet, x"),
    "corner_y": Variable(("corner",), "m", "place in plan where two walls meet, y"),
    "corner_first_wall": Variable(("corner",), "1", "number of the first of the two walls that meet, from 0"),
    "corner_second_wall": Variable(("corner",), "1", "number of the second of the two walls that meet, from 0"),
    "corner_shear_force": Variable(
        (*_STEP, "corner"), "N", "vertical shear of the masonry: upward force of the first wall on the second"
    ),
    "corner_footing_force": Variable(
        (*_STEP, "corner"), "N", "upward force of the first wall's footing on the second wall's footing"
    ),
    "corner_slip_max": Variable((*_STEP, "corner"), "m", "largest vertical slip of the masonry along the corner"),
}
for _name in BY_WALL:
    _path = VARIABLES[_name]
    OF_HOUSE[f"wall_{_name}"] = replace(_path, dims=(*_path.dims, "wall"), long_name=f"{_path.long_name}, of each wall")
VARIABLES |= OF_HOUSE

END_VARIABLES = (
    *CATEGORY_VARIABLES,
    *("crack_width_max", "crack_band_width_max", "dpc_opening_max", "footing_opening_max", "tilt_max", "slope_max"),
    *("central_deflection", "deflection_ratio", "surface_movement", "settlement", "crack_group_width"),
)
"""Results at the end of a sample's own movement, in a study that stores both path and end."""

for _name in (*END_VARIABLES, *(f"wall_{name}" for name in END_VARIABLES if name in BY_WALL)):
    _path = VARIABLES[_name]
    VARIABLES[f"end_{_name}"] = replace(
        _path, dims=("sample", *_path.dims[1:]), long_name=f"{_path.long_name}, at the end of the sample's movement"
    )


def name_categories(ds: xr.Dataset, names: tuple[str, ...], comment: str) -> None:
    """Set the category names of the damage table that made the categories of a dataset."""
    for name in (*CATEGORY_VARIABLES, WORST_CATEGORY):
        if name in ds:
            ds[name].attrs = category_attributes(names, comment, name)


def category_attributes(names: tuple[str, ...], comment: str, variable: str = "damage_category") -> dict[str, Any]:
    """Attributes of damage categories with the names of their damage table."""
    flags = tuple(name.replace(" ", "_") for name in names)
    registered = VARIABLES[variable]
    return Variable(registered.dims, None, registered.long_name, flags).attributes() | {"comment": comment}


def wall_attributes(names: Sequence[str]) -> dict[str, Any]:
    """Attributes of the walls of a house with these names."""
    return replace(VARIABLES["wall"], units=None, flags=tuple(names)).attributes()


def with_shared_movement(ds: xr.Dataset) -> xr.Dataset:
    """Study with the coordinate ``increment``, and ``movement`` where all samples have the same."""
    if not {"sample", "increment"} <= ds.sizes.keys():
        return ds
    number = np.arange(ds.sizes["increment"])
    ds = ds.assign_coords(increment=("increment", number, VARIABLES["increment"].attributes()))
    for name in ("surface_movement", "settlement", "central_deflection"):
        if name in ds.variables and ds[name].dims == ("sample", "increment"):
            least, most = ds[name].min("sample").values, ds[name].max("sample").values
            if np.array_equal(least, most):  # False with NaN
                attributes = VARIABLES["movement"].attributes() | {"comment": f"is {name}"}
                return ds.assign_coords(movement=("increment", least, attributes))
    return ds


def flag_name(ds: xr.Dataset, value: int, variable: str = "damage_category") -> str:
    """Meaning of a value of a flag variable in plain words, ``"not known"`` if it has none."""
    registered = VARIABLES[variable].flags if variable in VARIABLES else ()
    given = ds[variable].attrs.get("flag_meanings") if variable in ds.variables else None
    names = str(given).split() if given else registered
    return names[value].replace("_", " ") if 0 <= value < len(names) else "not known"


def category_label(ds: xr.Dataset, category: int, variable: str = "damage_category") -> str:
    """Number and name of a damage category, such as ``"2 slight"``."""
    return f"{category} {flag_name(ds, category, variable)}" if category >= 0 else "not known"


FLAG_FILL = np.int8(-1)
"""Value of an unknown flag."""


def is_dynamic(ds: xr.Dataset) -> bool:
    """Whether an archive is from a run in physical time; a history has a time too, but also stages."""
    return "time" in ds.variables and "stage" not in ds.variables


def dataset(
    values: Mapping[str, Any],
    attributes: Mapping[str, Any],
    dims: Mapping[str, tuple[str, ...]] | None = None,
    extra: Mapping[str, Variable] | None = None,
) -> xr.Dataset:
    """CF dataset of values under their registered names."""
    registered = {**VARIABLES, **(extra or {})}
    variables = {
        name: xr.Variable(
            (dims or {}).get(name, registered[name].dims), np.asarray(value), registered[name].attributes()
        )
        for name, value in values.items()
    }
    coordinates = {name for name, v in variables.items() if v.dims == (name,)} | (
        {*MOVEMENTS, "central_deflection", "deflection_ratio", "strain", "movement", "time"} & set(variables)
    )
    ds = xr.Dataset(
        {k: v for k, v in variables.items() if k not in coordinates},
        coords={k: v for k, v in variables.items() if k in coordinates},
    )
    conventions = "CF-1.11 UGRID-1.0" if MESH in ds else "CF-1.11"
    ds.attrs = {"Conventions": conventions, "schema_version": SCHEMA_VERSION} | {
        key: (int(value) if isinstance(value, bool | np.bool_) else value)
        for key, value in attributes.items()
        if value is not None
    }
    return ds
