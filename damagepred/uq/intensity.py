"""Intensity measures of fragility curves: measures of the movement, read or computed from an archive."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray
from damagepred.enumerations import LOCAL
from damagepred.errors import InputError, nearest

MEASURES = (
    *("surface_movement", "differential_movement", "central_deflection", "deflection_ratio", "settlement"),
    *("differential_settlement", "angular_distortion", "ground_tilt", "horizontal_strain", "curvature"),
    *("footing_curvature", "load_displacement", "time", "strain"),
)
"""Intensity measures, and also any variable of the dataset on (sample, increment) that grows with the movement.

The archive lacks ``differential_movement``, y_m of a mound, the share of y_s between edge and middle (m); and two
curvatures (1/m): ``curvature`` of the arc with the central deflection, 8 D / L^2, a mean over the wall; and
``footing_curvature``, the largest of all sections, which is far larger where concrete cracks.
"""

OF_SITE = "surface movement"  # words of the movement y_s by which sites are classed
_MADE_OF = {
    "curvature": ("central_deflection", "deflection_ratio"),
    "footing_curvature": ("section_curvature",),
    "differential_movement": ("surface_movement",),
}
_NAMES = {
    "curvature": ("m-1", "mean curvature of the footing, 8 times the deflection over the length squared"),
    "footing_curvature": ("m-1", "largest curvature of the footing"),
    "differential_movement": ("m", "differential movement y_m of the ground's surface"),
}


class ShownMeasure(NamedTuple):
    """How a measure is shown: its name in words, its unit, and the factor from SI units."""

    words: str
    unit: str
    factor: float


def shown_measure(words: str, units: str) -> ShownMeasure:
    """Name, unit and factor that show a measure with these words and units."""
    unit = "mm" if units == "m" else "mm/m" if words == "strain" else units
    return ShownMeasure(words, unit, 1e3 if unit.startswith("mm") else 1.0)


def in_unit(value: float, units: str) -> str:
    """Movement with the unit in which it is shown."""
    _, unit, factor = shown_measure("", units)
    return f"{factor * value:.4g} {unit}".removesuffix(" 1")


def check_states(ds: xr.Dataset, name: str) -> None:
    """Refuse to read paths of older versions in between, which scaled a Walsh mound of the final surface movement."""
    if name not in ("surface_movement", "differential_movement") or "surface_movement" not in ds:
        return
    if "ground_states" in ds["surface_movement"].attrs:
        return
    scene = tomllib.loads(str(ds.attrs.get("scene", "")))
    mound, movement, length = (scene.get(key, {}) for key in ("mound", "movement", "wall"))
    if movement.get("shape") != "mound" or mound.get("shape", "walsh") != "walsh":
        return
    from damagepred.scene.mound import Mound

    if not Mound(**mound).proportional(length.get("length", 0.0), movement.get("kind", "dishing")):
        raise InputError(
            f"{name}: this study was made by a version that scaled the Walsh mound of the final surface movement, so a "
            "wall on the way is not that of a smaller surface movement; run the study again."
        )


def movement_measure(ds: xr.Dataset) -> str:
    """Measure that drives a study or a wall: of the ground, of a laboratory test, otherwise the deflection."""
    if "load_displacement" in ds.variables:
        return "load_displacement"
    ground = (n for n in ("surface_movement", "settlement") if n in ds and bool(np.isfinite(ds[n].values).any()))
    return next(ground, "central_deflection")


def movement_words(ds: xr.Dataset, measure: str | None = None) -> str:
    """Name in words of the movement of a wall, a study or results of one; only of a reactive site ``OF_SITE``."""
    name = measure or str(ds.attrs.get("intensity_measure", "")) or movement_measure(ds)
    if name == "settlement":
        own = ds["intensity"].attrs.get("long_name") if "intensity" in ds.coords else None
        return str(own or _settlement_words(str(ds.attrs.get("scene", ""))))
    if name != "surface_movement":
        return name.replace("_", " ")
    kept = [str(ds[coord].attrs.get("long_name")) for coord in ("intensity", "movement") if coord in ds.coords]
    # of the house of a wall, or its own
    words = ds.attrs.get("ground") or _ground_words(str(ds.attrs.get("scene", "")))
    return next((words for words in kept if words in LOCAL.values()), str(words))


@lru_cache(maxsize=8)
def _ground_words(scene: str) -> str:
    tables = tomllib.loads(scene)
    on_mound = tables.get("movement", {}).get("shape") == "mound"
    return LOCAL.get(tables.get("mound", {}).get("shape"), OF_SITE) if on_mound else OF_SITE


@lru_cache(maxsize=8)
def _settlement_words(scene: str) -> str:
    movement = tomllib.loads(scene).get("movement", {})
    what = "heave" if movement.get("kind") == "heave" else "settlement"
    measure, shape = movement.get("settlement_is", "largest"), movement.get("shape")
    if measure != "largest":
        return f"differential {what}" if measure == "range" else f"{what} relative to the ends"
    of_shape = {"tilt": f"{what} of one end", "trough": f"{what} at the trough's axis", "step": "step of the ground"}
    return of_shape.get(str(shape), f"largest {what}")


def chosen_intensity(ds: xr.Dataset, intensity: str | None) -> str:
    """Name of the measure of the movement, by default the study's own."""
    name = intensity or movement_measure(ds)
    if _available(ds, name):
        return name
    if not (available := [m for m in MEASURES if _available(ds, m)]):
        raise InputError("the study has no finished sample yet; run `damagepred study` first.")
    raise InputError(
        f"intensity: the dataset has no variable '{name}' with values; it has {', '.join(available)}."
        + nearest(name, available)
    )


def _available(ds: xr.Dataset, name: str) -> bool:
    parts = _MADE_OF.get(name, (name,)) if name not in ds.variables else (name,)
    if not all(name_ in ds.variables and ds[name_].dims[:1] == ("sample",) for name_ in parts):
        return False
    if name == "curvature" and "settlement" in ds:  # the profile is no arc
        return False
    if name == "differential_movement" and name not in ds.variables and _movement_ratio(ds) is None:
        return False
    return all(np.issubdtype(ds[p].dtype, np.number) and bool(np.isfinite(ds[p].values).any()) for p in parts)


def attributes(ds: xr.Dataset, name: str) -> dict[str, str]:
    """Return unit and name in words of a measure."""
    if name in ds.variables:
        stated = ds[name].attrs
        if name == "settlement":
            stated = {**stated, "long_name": movement_words(ds, name)}
        if name == "surface_movement" and (words := movement_words(ds, name)) != OF_SITE:
            stated = {**stated, "long_name": words}
        return {"long_name": str(stated.get("long_name", name)), "units": str(stated.get("units", "1"))}
    units, words = _NAMES[name]
    return {"long_name": words, "units": units}


def intensity_values(ds: xr.Dataset, name: str) -> FloatArray:
    """Measure of the movement, array (sample, increment) or (sample,)."""
    if name in ds.variables:
        values = np.asarray(ds[name].values, dtype=np.float64)
        # a test reverses, and bricks grow or shrink
        return np.abs(values) if name in ("load_displacement", "strain") else values
    if name == "curvature":
        deflection, ratio = (np.asarray(ds[part].values, dtype=np.float64) for part in _MADE_OF[name])
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(deflection > 0, 8.0 * ratio**2 / deflection, deflection)
    if name == "footing_curvature":
        return np.abs(np.asarray(ds["section_curvature"].values, dtype=np.float64)).max(axis=-1)
    if name != "differential_movement":
        raise InputError(f"intensity: the dataset has no variable '{name}'." + nearest(name, MEASURES))
    share = np.asarray(_movement_ratio(ds), dtype=np.float64)
    y_s = np.asarray(ds["surface_movement"].values, dtype=np.float64)
    return y_s * (share.reshape(-1, *(1,) * (y_s.ndim - 1)) if share.ndim else share)


def _movement_ratio(ds: xr.Dataset) -> FloatArray | float | None:
    """y_m / y_s of each wall or of all, from the sampled values or the scene; None where both lack it."""
    if "mound.movement_ratio" in ds.variables:
        return np.asarray(ds["mound.movement_ratio"].values, dtype=np.float64)
    text = ds.attrs.get("scene")
    if not isinstance(text, str):
        return None
    scene: Mapping[str, Mapping[str, object]] = tomllib.loads(text)
    mound, kind = scene.get("mound"), scene.get("movement", {}).get("kind")
    if not mound or kind is None:
        return None
    from damagepred.scene.mound import Mound

    ratio = {key: mound[key] for key in ("shape", "movement_ratio") if key in mound}
    ratio |= {"table": mound["table"]} if mound.get("shape") == "table" else {}
    return float(Mound(surface_movement=1.0, **ratio).largest(kind))  # type: ignore[arg-type]
