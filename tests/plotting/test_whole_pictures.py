"""Whole pictures of invented results, artist by artist, against the lists in ``pictures/`` (see ``tests.recorded``)."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import damagepred
from damagepred import Scene, plotting
from damagepred.archive.schema import VARIABLES
from damagepred.plotting.analyses import draw_scales
from damagepred.plotting.pictures import half_way, stress_sheet, stress_sheets
from damagepred.plotting.sheet import figure_of
from tests.plotting.inventory import inventory
from tests.plotting.test_draw_wall import TREE, WALL, WINDOW
from tests.recorded import check

LISTS = Path(__file__).parent / "pictures"

SIZES = {"m": 4e-3, "Pa": 2e5, "rad": 3e-3, "N": 4e3, "m-1": 2e-4, "N m": 600.0, "J": 3.0}
SIGNED = ("displacement", "rotation", "stress", "curvature", "moment", "strain", "change", "load_force")


def invented(wall: xr.Dataset) -> xr.Dataset:
    """Wall with plain formulas for results, so that no solver can change its pictures."""
    ds = wall.copy(deep=True)
    rise = np.linspace(0.0, 1.0, ds.sizes["increment"])
    kept = ("increment", "progress", "stage", "time", "central_deflection", "deflection_ratio", "surface_movement")
    for name in ds.variables:
        field = ds[name]
        if "increment" not in field.dims or name in kept:
            continue
        if np.issubdtype(field.dtype, np.integer):  # counts of the solver; states and categories follow
            ds[name] = field.dims, (0 * field.values.T + np.arange(ds.sizes["increment"]) % 5).T, field.attrs
            continue
        number = np.arange(field.values[0].size).reshape(field.shape[1:])
        wave = np.sin(0.7 * number + len(str(name)))
        if not any(word in str(name) for word in SIGNED):
            wave = wave**2
        size = SIZES.get(str(VARIABLES[str(name)].units) if name in VARIABLES else "1", 1.0)
        ds[name] = field.dims, size * np.multiply.outer(rise, wave), field.attrs
    if "section_x" in ds:  # a footing that finds its own form
        ds["central_deflection"][:] = 2e-4 * rise
        ds.attrs |= {"limit_deflection": 1.5e-4} if "limit_deflection" in ds.attrs else {}
    ds["contact_broken_at"][:] = np.where(np.arange(ds.sizes["contact"]) % 3, 0.5, np.nan)
    down = np.sin(np.pi * ds["block_x"].values / float(ds["vertex_x"].max()))
    ds["block_displacement_y"][:] = -4e-3 * rise[:, None] * down
    opening = ds["contact_opening"].values.copy()
    ds["contact_opening"][:] = np.where(opening < 1.2e-3, -1e-6, 4.0 * opening * np.cos(ds["contact_x"].values) ** 2)
    ds["contact_state"][:] = (opening > 1.5e-3) + 2 * ((opening > 5e-4) & (opening < 8e-4))
    for of, width in (("", "crack_width_max"), ("_band", "crack_band_width_max")):
        ds[f"damage_category{of}"][:] = np.searchsorted([1e-4, 1e-3, 5e-3], ds[width].values)
    if "zone_state" in ds:
        ds["zone_state"][:] = np.multiply.outer(np.arange(len(rise)) > 0, np.arange(ds.sizes["zone"]) % 5)
    return ds


@cache
def solved(name: str) -> xr.Dataset:
    """Wall with the blocks and joints of a scene, and invented results."""
    wall, dpc, door = {"length": 1.2, "height": 0.45}, {"course": 1}, {"kind": "door", "x": 0.48, "width": 0.24}
    shear = {"side": "left", "share": 2.0, "at": 0.25, "width": 0.1, "direction": "along"}
    stages = [("dishing", 1e-4, 2), ("doming", 5e-5, 3), ("dishing", 0.0, 1)]
    stage = [{"kind": kind, "central_deflection": size, "increments": n} for kind, size, n in stages]
    tables: dict[str, dict[str, Any]] = {
        "door": {"wall": wall, "opening": [door | {"height": 0.3}], "control_joint": [{"x": 0.84}]},
        "pier": {
            "movement": {"shape": "loads", "increments": 3},
            "load": [{"at": 0.3, "width": 0.2}, shear],
            "support": [{"x": 0.12, "width": 0.1}, {"x": 1.0, "width": 0.2}],
            "loading": {"control": "force", "force": "100 N"},
        },
        "broken": {"block": {"tensile_strength": 2e6, "fracture_energy": 80.0}},
        "elastic": {"solver": {"blocks": "elastic"}, "dpc": dpc},
        "history": {"dpc": dpc, "movement": {"central_deflection": 1e-4, "stage": stage}},
    }
    small = {"title": f"{name} for $5", "wall": wall, "movement": {"central_deflection": 1e-4, "increments": 2}}
    rigid = {"solver": {"blocks": "rigid"}}
    return invented(damagepred.solve(Scene.from_dict(small | rigid | tables[name])))


def scene(**tables: Any) -> Scene:
    return Scene.from_dict({"wall": WALL, **tables})


def comparison() -> xr.Dataset:
    shape = (3, 2, 3)
    base = np.linspace(0.05, 0.9, 18).reshape(shape)
    names = ("probability", "probability_lower", "probability_upper", "difference", "difference_lower")
    values = {name: base * f for name, f in zip(names, (0.8, 0.6, 1.0, -0.4, -0.6))}
    values["difference_upper"] = 0.2 - 0.3 * base
    dims = ("study", "category", "movement")
    coords = {
        "study": ["as it is", "costs $", "third"],
        "category": ("category", [1, 3], {"flag_meanings": "negligible very_slight slight moderate"}),
        "movement": ("movement", [0.004, 0.008, 0.016], {"units": "m", "measure": "central_deflection"}),
    }
    ds = xr.Dataset({k: (dims, v) for k, v in values.items()}, coords, {"reference": "as it is", "confidence": 0.9})
    return ds.assign(paired_samples=("study", [60, 44, 52]))


def search(quantity: str) -> xr.Dataset:
    middle = np.array([0.30, 0.22, 0.12, 0.16, 0.05]) * (1.0 if quantity == "probability" else 1e4)
    of = "alternative"
    return xr.Dataset(
        (
            {"cost": (of, [0.0, 500.0, 900.0, 1200.0, 2500.0]), quantity: (of, middle)}
            | {f"{quantity}_lower": (of, 0.7 * middle), f"{quantity}_upper": (of, 1.2 * middle)}
            | {"decision": (of, [2, 2, 1, 0, 0]), "value": ("measure", [-0.08, 0.03])}
            | {"value_error": ("measure", [0.02, 0.01])}
        ),
        {"measure": ["deeper footing", "more $"]},
        {"quantity": quantity, "limit": 0.2, "chosen": "" if quantity == "probability" else "deep"},
    )


def portfolio(houses: int) -> xr.Dataset:
    reached = np.outer(np.linspace(0.9, 0.2, houses), [1.0, 0.6, 0.3, 0.1])
    reached[2] = np.nan
    return xr.Dataset(
        {"probability": (("house", "category"), reached), "walls": ("house", np.full(houses, 40))},
        {"house": [f"no. {n} $" for n in range(houses)], "category": [1, 2, 3, 4]},
        {"title": "High Street"},
    )


def posterior(alike: bool) -> xr.Dataset:
    """Two causes with three and two walls; measures alike with a crack map, or unlike without."""
    weight = np.array([[0.1, 0.2], [0.0, 0.15], [0.05, 0.1], [0.2, 0.0], [0.15, 0.05]])
    ds = xr.Dataset(
        {
            "posterior": (("sample", "increment"), weight),
            "movement": (("sample", "increment"), np.array([[1, 3], [2, 4], [5, 2], [1, 2], [3, 4]]) * 1e-3),
            "study_of_sample": ("sample", [0, 0, 0, 1, 1]),
            "movement_measure": ("study", ["central_deflection", "central_deflection" if alike else "strain"]),
            "movement_units": ("study", ["m", "m" if alike else "1"]),
            "movement_largest": ("study", [5e-3, 4e-3]),
            "posterior_odds": ("study", [2.5, 200.0]),
            "cause_posterior": ("study", [0.7, 0.3]),
            "resembles": ("study", [False, alike]),
        },
        {"study": ["sag", "hog $"]},
    )
    if alike:
        probability = ("study", "map_y", "map_x"), np.linspace(0.0, 0.9, 12).reshape(2, 2, 3), {"wider_than": 1e-3}
        described = Scene.from_dict({"wall": {"length": 0.96, "height": 0.225}}).to_toml()
        places = {"observed_x": [0.2, 0.5, 0.7], "observed_y": [0.05, 0.2, 0.1], "observed_width": [2e-3, 0.0, 4e-3]}
        levels = {
            "x": [0.1, 0.9],
            "y": [0.0, 0.1],
            "to_x": [0.8, 0.3],
            "to_y": [0.1, 0.1],
            "difference": [-3.2e-3, 1e-3],
        }
        ds = ds.assign(
            {n: ("observed", v) for n, v in places.items()}
            | {f"level_{n}": ("level", v) for n, v in levels.items()}
            | {
                "observed_limit": ("observed", ["", "", "below"]),
                "map_x": ("map_x", [0.1, 0.5, 0.9]),
                "map_y": ("map_y", [0.0, 0.2]),
                "study_scene": ("study", [described] * 2),
                "crack_probability": probability,
            }
        )
    return ds


def scales() -> xr.Dataset:
    shares = np.array([[1.0, 0.75, np.nan], [0.75, 1.0, 0.4], [np.nan, 0.4, 1.0]])
    of = {"agreement": (("scale", "other"), shares), "share_reached": ("scale", [0.5, 0.2, 0.1])}
    return xr.Dataset(of, {"scale": ["AS 2870", "BRE $", "psi"]})


def shares() -> xr.Dataset:
    values = {"spearman": [0.2, -0.7, 0.05], "partial": [0.3, -0.8, 0.1], "first_order": [0.1, 0.6, np.nan]}
    of = {name: ("variable", np.array(v)) for name, v in values.items()}
    for name, v in values.items():
        of |= {f"{name}_lower": ("variable", np.array(v) - 0.1), f"{name}_upper": ("variable", np.array(v) + 0.05)}
    names = ["joint.cohesion", "dpc.friction", "loads.roof"]
    attrs = {"title": "a house", "output": "capacity of category 2", "walls": 90, "confidence": 0.8}
    return xr.Dataset(of, {"variable": names}, attrs | {"share_censored": 0.25})


def on_ground(curves: xr.Dataset) -> xr.Dataset:
    """Curves over the ground's own movement, with failed walls, one doubtful, with shares as steps."""
    ds = curves.copy()
    ds.attrs |= {"intensity_measure": "surface_movement", "model": "common"}
    ds["p_value"] = "category", [0.01, 0.5, np.nan]
    ds["empirical"] = ds["probability"].fillna(0.0).round(1)
    for end, factor in (("undamaged", 0.7), ("damaged", 1.0)):
        ds[f"probability_failed_{end}"] = factor * ds["probability"]
    return ds


def extrapolated(curves: xr.Dataset) -> xr.Dataset:
    """Curves over the deflection ratio, without forms or beyond the path."""
    ds = curves.assign_coords(intensity=("intensity", curves["intensity"].values / 6.0, {"units": "1"}))
    ds.attrs |= {"intensity_measure": "deflection_ratio", "movements": np.array([0.0, 2e-3, 6e-3])}
    ds["fit_status"] = "category", ["empirical", "extrapolated", "no wall reached it"]
    ds["median"] = "category", [2e-3, 9e-3, np.nan]
    ds["median_lower_bound"] = "category", [np.nan, 5e-3, np.nan]
    return ds.assign(empirical=ds["probability"].fillna(0.0))


def weighted(study: xr.Dataset) -> xr.Dataset:
    """Study with a band of cracks, weights of the walls, and a category that no wall has reached."""
    ds = study.assign(crack_band_width_max=0.7 * study["crack_width_max"])
    ds["tilt_max"] = study["crack_width_max"].dims, 0.2 * study["crack_width_max"].values[:, ::-1], {"units": "rad"}
    ds["damage_category"] = ds["damage_category"].clip(max=3)
    return ds.assign(weight=("sample", np.linspace(0.5, 2.0, 8)))


OF_SITE = {"span": 6.0, "intensity_measure": "central_deflection"}
MARKS = {"this site": (0.01, 0.02), "mean": (0.015, 0.015)}
SAG, HOG = {"kind": "dishing", "central_deflection": 8e-3}, {"kind": "doming", "central_deflection": 4e-3}
ON_JACKS = {"movement": {"shape": "jacks", "kind": "doming"}, "rig": {"jacks": [1.5, 2.5]}}
TESTED = {
    "movement": {"shape": "loads"},
    "load": [{}, {"side": "right", "share": 3, "at": 0.5, "width": 0.4}],
    "loading": {"force": "40 kN"},
}
LOADS = [
    {"name": "floor", "line_load": 2e3, "y": 0.8},
    {"name": "people", "kind": "live", "line_load": 1e3, "combination": 0.5, "end": 2.0},
    {"force": 3e3, "at": 3.0},
]
FOOTED = {**TREE, "dpc": {"course": 2}, "loads": {"roof": "8 kN"}, "opening": [WINDOW], "control_joint": [{"x": 3.5}]}
Draw = Callable[[Any], Figure | Axes | list[Axes]]
PICTURES: dict[str, tuple[str, Draw]] = {
    # name: fixture, scene of `solved`, or nothing; drawing
    "wall": ("cracked", lambda ds: plotting.draw_wall(ds, slips=True)),
    "wall_on_dpc": ("on_dpc", lambda ds: plotting.draw_wall(ds, increment=2)),
    "wall_with_door": ("door", plotting.draw_wall),
    "wall_with_zones": ("deformable", lambda ds: plotting.draw_wall(ds, exaggeration=1.0)),
    "wall_on_jacks": ("on_jacks", lambda ds: plotting.draw_wall(ds, increment=1)),
    "wall_on_mound": ("on_mound", plotting.draw_wall),
    "wall_tested": ("pier", plotting.draw_wall),
    "wall_of_halves": ("broken", plotting.draw_wall),
    "cracks": ("cracked", plotting.draw_cracks),
    "cracks_of_dpc": ("on_dpc", lambda ds: plotting.draw_cracks(ds, increment=1)),
    "cracks_of_halves": ("broken", plotting.draw_cracks),
    "stress_rigid": ("on_dpc", lambda ds: stress_sheets(ds)["stress_xx.png"]),
    "stress_elastic": ("elastic", lambda ds: plotting.draw(ds, "stress_smallest")),
    "stress_zones": ("deformable", lambda ds: stress_sheet(ds, [("stress_xy", half_way(ds)), ("stress_xy", 2)])),
    "stress_on_footing": ("on_mound", lambda ds: plotting.draw(ds, "stress_yy", levels=[-0.2, -0.1, 0.0, 0.05])),
    "stress_of_halves": ("broken", lambda ds: plotting.draw(ds, "stress_xx", exaggeration=0.0)),
    "zone_states": ("deformable", lambda ds: stress_sheets(ds)["zone_states.png"]),
    "blocks": ("door", lambda ds: plotting.draw(ds, "block_displacement_y", increment=1)),
    "contacts": ("on_dpc", lambda ds: plotting.draw(ds, "contact_shear_stress")),
    "contact_states": ("door", lambda ds: plotting.draw(ds, "contact_state")),
    "gridpoints": ("deformable", lambda ds: plotting.draw(ds, "gridpoint_displacement_x")),
    "dpc": ("on_dpc", lambda ds: plotting.draw(ds, "dpc_opening")),
    "bed_on_footing": ("on_mound", lambda ds: plotting.draw(ds, "footing_opening")),
    "footing_on_jacks": ("on_jacks", lambda ds: plotting.draw(ds, "footing_rise")),
    "footing_on_mound": ("on_mound", lambda ds: plotting.draw(ds, "footing_rise")),
    "sections": ("on_jacks", lambda ds: plotting.draw(ds, "section_moment")),
    "jack_load": ("on_jacks", lambda ds: plotting.draw(ds, "support_load", plotting.draw(ds, "jack_load", label="a"))),
    "opening_width": ("on_dpc", lambda ds: plotting.draw(ds, "opening_width_change")),
    "hysteresis": ("history", lambda ds: plotting.draw(ds, "dpc_opening_max")),
    "load": ("pier", lambda ds: plotting.draw(ds, "load_force", against="load_displacement")),
    "history": ("on_jacks", plotting.draw_history),
    "history_on_mound": ("on_mound", plotting.draw_history),
    "history_in_stages": ("history", plotting.draw_history),
    "history_in_time": ("cracked", lambda ds: plotting.draw_history(ds.assign_coords(time=0.25 * ds["increment"]))),
    "scene_tree": ("", lambda _: plotting.draw_scene(scene(**FOOTED))),
    "scene_history": ("", lambda _: plotting.draw_scene(scene(movement={"stage": [SAG, HOG]}))),
    "scene_jacks": ("", lambda _: plotting.draw_scene(scene(**ON_JACKS))),
    "scene_loads": ("", lambda _: plotting.draw_scene(scene(load=LOADS, **TREE))),
    "scene_test": ("", lambda _: plotting.draw_scene(scene(**TESTED))),
    "paths": ("study", lambda ds: plotting.draw(ds, "crack_width_max")),
    "paths_weighted": ("study", lambda ds: plotting.draw(weighted(ds), "crack_width_max")),
    "paths_of_tilt": ("study", lambda ds: plotting.draw(weighted(ds), "tilt_max")),
    "category_shares": ("study", plotting.draw_category_shares),
    "category_shares_weighted": ("study", lambda ds: plotting.draw_category_shares(weighted(ds))),
    "fragility": ("curves", lambda ds: plotting.draw_fragility(ds.assign_attrs(**OF_SITE), marks=MARKS)),
    "fragility_on_ground": ("curves", lambda ds: plotting.draw_fragility(on_ground(ds))),
    "fragility_by_ratio": ("curves", lambda ds: plotting.draw_fragility(extrapolated(ds))),
    "comparison": ("", lambda _: plotting.draw_comparison(comparison(), 3)),
    "sensitivity": ("", lambda _: plotting.draw_sensitivity(shares())),
    "design_by_probability": ("", lambda _: plotting.draw_design_search(search("probability"))),
    "design_by_cost": ("", lambda _: plotting.draw_design_search(search("expected_cost"))),
    "portfolio": ("", lambda _: plotting.draw_portfolio(portfolio(4))),
    "portfolio_long": ("", lambda _: plotting.draw_portfolio(portfolio(45))),
    "posterior": ("", lambda _: plotting.draw_back_analysis(posterior(alike=True))),
    "posterior_of_unlike_measures": ("", lambda _: plotting.draw_back_analysis(posterior(alike=False))),
    "scales": ("", lambda _: draw_scales(scales())),
}


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_its_list(name: str, request: pytest.FixtureRequest) -> None:
    source, draw = PICTURES[name]
    ds = None
    if source in ("study", "curves"):
        ds = request.getfixturevalue(source)
    elif source in ("cracked", "on_dpc", "deformable", "on_jacks", "on_mound"):
        ds = invented(request.getfixturevalue(source))
    elif source:
        ds = solved(source)
    drawn = draw(ds)
    drawn = drawn[0] if isinstance(drawn, list) else drawn
    figure = drawn if isinstance(drawn, Figure) else figure_of(drawn)
    check(LISTS / f"{name}.txt", "\n".join(inventory(figure)).splitlines())
