"""Soil under a footing: springs without tension."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isclose
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from damagepred.errors import InputError
from damagepred.scene.described import completed_by, described, require_name
from damagepred.scene.movement_stage import Kind
from damagepred.scene.quantity import Count, Length, Pure, Stiffness
from damagepred.scene.site import of_climatic_zone, suction_depth


@described
class Soil:
    """Soil under the footing (``[soil]``), read with ``[movement] shape = "mound"``: Winkler springs without tension.

    Examples
    --------
    >>> from damagepred import Soil
    >>> Soil(swelling_stiffness="1 MPa/m").swelling_stiffness
    1000000.0
    """

    swelling_stiffness: Stiffness = Field(default=4.0e6, gt=0)
    """Pressure per displacement (Pa/m) of swelling soil, read in heave and in dishing, when the edges heave. AS
    2870-2011 has 100 / m times the mean pressure q on the soil, and at least 1000 kPa/m. (Secondary: manual of the
    design program CORD, FMG Engineering.) Under strip footings of masonry q is about 40 kPa: 4000 kPa/m. The least
    value is for a slab of about 10 kPa. Too small a value is unsafe: the footing sinks into the swelling soil, and the
    wall is bent less (``studies/soil_movement``)."""
    shrinking_stiffness: Stiffness = Field(default=5.0e6, gt=0)
    """Pressure per displacement of shrinking soil, read in settle and in doming, when the edges dry; 5000 kPa/m
    (assumed)."""
    shear_stiffness: Stiffness | None = Field(default=None, gt=0)
    """Shear stress per displacement along the wall (Pa/m). None: as the normal stiffness."""
    friction: Pure = Field(default=0.5, ge=0)
    """tan(phi) (1) between footing and soil, without cohesion."""

    @staticmethod
    def stiffness_key(kind: Kind) -> str:
        """Key of the normal stiffness: swelling soil gets wet, shrinking soil dries."""
        return "swelling_stiffness" if kind in ("dishing", "heave") else "shrinking_stiffness"

    def stiffness(self, kind: Kind) -> float:
        """Normal stiffness (Pa/m)."""
        return float(getattr(self, self.stiffness_key(kind)))

    def stiffness_along(self, kind: Kind) -> float:
        """Shear stiffness (Pa/m), by default the normal stiffness."""
        return self.stiffness(kind) if self.shear_stiffness is None else self.shear_stiffness


ZONES = tuple("123456")  # climatic zones of AS 2870, the wettest first


@described
class SoilLayer:
    """Layer of a soil log, from the surface down (``[[soil_layer]]``).

    In a scene file an entry may stand for a borehole of an AGS 4 file: with ``file`` and ``borehole`` (LOCA_ID). Its
    key ``indices`` then names a CSV or xlsx file of shrink-swell indices by geology code or plasticity index.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.SoilLayer(thickness="0.8 m", shrink_swell_index="4 %").shrink_swell_index
    0.04
    """

    thickness: Length = Field(gt=0)
    """Thickness of the layer (m)."""
    shrink_swell_index: Pure = Field(ge=0, le=0.3)
    """I_ss: strain of the soil per unit of suction in pF (1), in laboratory reports in per cent: ``"4 %"``. 0 for sand
    and rock."""
    name: str | None = None
    """Name of the layer in keys of variables, such as ``soil_layer.clay.shrink_swell_index``; by default its number,
    from 1."""

    @model_validator(mode="after")
    def _is_named(self) -> SoilLayer:
        require_name(self, "layer", "clay")
        return self


def _with_suction_change(table: Mapping[str, Any]) -> Mapping[str, Any]:
    """Table ``[suction]`` with the change of its climatic zone, unless it is given."""
    zone = _zone(table)
    return table if zone is None else {"change": of_climatic_zone("suction_change", zone), **table}


@described
class Suction:
    """Design change of the soil's suction (``[suction]``), read with ``[[soil_layer]]``.

    The change decreases linearly from the surface to 0 at ``mound.suction_depth``.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.Suction(change=1.2).cracked_share
    0.5
    """

    climate_zone: Count | None = Field(default=None, ge=1, le=6)
    """Climatic zone of AS 2870, 1 (wettest) to 6: default of ``mound.suction_depth`` (secondary) and ``change``
    (assumed), from ``data/ground/site_classes.toml``."""
    change: Pure = Field(default=1.2, gt=0, le=5)
    """Change at the surface (pF). Assumed: 1.2, of temperate climates in AS 2870."""
    cracked_share: Pure = Field(default=0.5, ge=0, le=1)
    """Depth of the cracked zone over the suction depth (1). Assumed. Cracks there let the soil move sideways."""
    restraint: Pure = Field(default=2.0, ge=1)
    """In the cracked zone the soil moves by I_ss, and below it, restrained at its sides, by alpha I_ss. At depth z
    alpha = restraint - z / restraint_depth (1). Assumed: 2.0."""
    restraint_depth: Length = Field(default=5.0, gt=0)
    """Depth in alpha (m). Assumed: 5 m."""
    below_log: Literal["extend", "inert"] | None = None
    """Soil between the end of the log and ``mound.suction_depth``. ``extend``: as the last layer. ``inert``: no
    movement, as in rock. None: a log that ends too early is refused."""

    _of_zone = completed_by(_with_suction_change)


def with_climate_zone(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of a scene with the suction depth of their climatic zone; given values take precedence."""
    merged, suction, mound = dict(tables), tables.get("suction"), tables.get("mound", {})
    if isinstance(mound, Mapping) and (zone := _zone(suction)) is not None:
        merged["mound"] = {"suction_depth": suction_depth(zone), **mound}
    return merged


def _zone(suction: Any) -> int | None:
    """Climatic zone of a table or object; None if it is missing or invalid."""
    zone = suction.get("climate_zone") if isinstance(suction, Mapping) else getattr(suction, "climate_zone", None)
    return int(str(zone)) if str(zone) in ZONES else None


def surface_movement(layers: Sequence[SoilLayer], suction: Suction, suction_depth: float) -> float:
    """Characteristic surface movement y_s of a soil log (m): the sum of alpha I_ss du dh over its depth.

    Parameters
    ----------
    layers : sequence of SoilLayer
        Layers from the surface down.
    suction : Suction
        Change of suction, restraint, and soil below the log.
    suction_depth : float
        Depth to which the suction changes (m).

    Raises
    ------
    InputError
        If the log ends above the suction depth without ``suction.below_log``.

    Examples
    --------
    >>> from damagepred import scene
    >>> clay = scene.SoilLayer(thickness="2 m", shrink_swell_index="4 %")
    >>> round(1e3 * scene.surface_movement([clay], scene.Suction(change=1.2, cracked_share=1), 2.0))
    48
    """
    bottom = np.cumsum([layer.thickness for layer in layers])
    if suction.below_log is None:
        inert, extended = (
            surface_movement(layers, replace(suction, below_log=below), suction_depth) for below in ("inert", "extend")
        )
        if not isclose(inert, extended, rel_tol=1e-9):
            raise InputError(
                f"soil_layer: the log ends at {bottom[-1]:g} m, and the suction changes to {suction_depth:g} m "
                f"(mound.suction_depth): y_s = {1e3 * inert:.3g} mm if nothing moves below the log, "
                f"{1e3 * extended:.3g} mm if its last layer goes on. Add the layers below, or give suction.below_log = "
                "'inert' or 'extend'."
            )
    elif suction.below_log == "extend":
        bottom[-1] = max(float(bottom[-1]), suction_depth)
    cracked = suction.cracked_share * suction_depth
    unstrained = suction.restraint * suction.restraint_depth  # alpha is 0 below
    kinks = [0.0, *bottom, cracked, unstrained, suction_depth]
    ends = np.unique(np.clip(kinks, 0.0, min(float(bottom[-1]), suction_depth)))
    total = 0.0
    for top, end in itertools.pairwise(ends):
        index = layers[int(np.searchsorted(bottom, 0.5 * (top + end)))].shrink_swell_index
        z = np.array([top, 0.5 * (top + end), end])
        alpha = np.ones(3) if end <= cracked else np.maximum(suction.restraint - z / suction.restraint_depth, 0.0)
        strain = index * alpha * suction.change * (1.0 - z / suction_depth)
        total += float(strain @ [1.0, 4.0, 1.0]) * (end - top) / 6.0  # Simpson's rule: exact for a parabola
    return total
