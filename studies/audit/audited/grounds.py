"""Displacement of the ground by its closed forms: prescribed shapes (FACTS 2) and mounds (FACTS 3, guide)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from damagepred.arrays import FloatArray


def movement_of(scene: dict[str, Any], x: FloatArray, progress: float) -> FloatArray:
    """Return the displacement of the ground (m, along the wall and upwards), array (c, 2).

    Parameters
    ----------
    scene : dict
        Tables of the scene, complete with defaults.
    x : array (c,)
        Places along the wall (m).
    progress : float
        Share of the full movement.
    """
    movement, length = scene["movement"], scene["wall"]["length"]
    up = 1.0 if movement["kind"] == "doming" else -1.0
    if movement["shape"] == "mound":
        return _mound(scene["mound"], x, length, movement["kind"], progress)
    deflection = progress * movement["central_deflection"]
    rise = up * deflection * prescribed(movement, x / length, deflection / length)
    return np.column_stack((np.zeros_like(rise), rise))


def prescribed(movement: dict[str, Any], xi: FloatArray, ratio: float) -> FloatArray:
    """Return the shape of a prescribed movement at a deflection ratio: 0 at the ends, 1 in the middle."""
    shape = movement["shape"]
    if shape == "parabola":
        return 1.0 - (2.0 * xi - 1.0) ** 2
    if shape == "arc":
        if ratio < 1e-6:
            return 1.0 - (2.0 * xi - 1.0) ** 2
        radius = (0.25 + ratio**2) / (2.0 * ratio)
        square = (xi - 0.5) ** 2
        # sagitta of the remaining chord, without the difference of two large numbers
        return np.asarray(1.0 - square / (radius + np.sqrt(radius**2 - square)) / ratio)
    if shape == "three_loads":
        # superposition of three equal point loads on a simply supported beam
        form = sum(_point_load(xi, a) for a in (0.25, 0.5, 0.75))
        return np.asarray(form / sum(_point_load(np.array([0.5]), a)[0] for a in (0.25, 0.5, 0.75)))
    position, fraction = np.array(movement["table"]).T
    spline = PchipInterpolator(position, fraction)
    return np.asarray(spline(xi) / spline(0.5))


def _point_load(xi: FloatArray, a: float) -> FloatArray:
    """Return the deflection of a simply supported beam of unit span under a load at a, times 6 EI / P."""
    left = (1 - a) * xi * (1 - (1 - a) ** 2 - xi**2)
    right = a * (1 - xi) * (1 - a**2 - (1 - xi) ** 2)
    return np.where(xi <= a, left, right)


def _mound(mound: dict[str, Any], x: FloatArray, length: float, kind: str, progress: float) -> FloatArray:
    """Return the free surface at a share of ``surface_movement``: the mound of that movement."""
    shape, doming = mound["shape"], kind == "doming"
    size = progress * mound["surface_movement"]
    if shape in ("walsh", "mitchell"):
        y_m = mound.get("movement_ratio", 0.7 if doming else 0.5) * size
        if shape == "walsh":
            edge = mound.get("edge_distance", _edge(mound, length, 1e3 * y_m, doming))
            into = np.maximum(min(edge, length / 2) - np.minimum(x, length - x), 0.0)
            form = (into / min(edge, length / 2)) ** 2
        else:
            default = mound["exponent_factor"] * length / (mound["suction_depth"] - mound["embedment"])
            form = np.abs(2.0 * x / length - 1.0) ** mound.get("exponent", default)
        rise = y_m * form * (-1.0 if doming else 1.0)
        return np.column_stack((np.zeros_like(rise), rise))
    away = x - mound.get("position", 0.0 if shape == "tree" else length / 2)
    along = np.zeros_like(x)
    if shape == "tree":
        form = np.clip(1.0 - np.abs(away) / mound.get("reach", length), 0.0, None) ** mound.get("exponent", 2.0)
    elif shape == "pipe":
        form = np.cos(0.5 * np.pi * np.minimum(np.abs(away) / mound.get("reach", length / 2), 1.0)) ** 2
    elif shape == "tunnel":
        reach = mound["reach"] if "reach" in mound else mound["trough_width"] * mound["tunnel_depth"]
        form = np.exp(-0.5 * (away / reach) ** 2)
    else:
        position, fraction = np.array(mound["table"]).T
        form = PchipInterpolator(position, fraction)(x / length)
    rise = size * form * (1.0 if doming else -1.0)
    if shape == "tunnel" and "tunnel_depth" in mound:
        along = rise * away / mound["tunnel_depth"]
    return np.column_stack((along, rise))


def _edge(mound: dict[str, Any], length: float, millimetres: float, doming: bool) -> float:
    """Return the edge distance (m) of the Walsh mound of a movement y_m (mm)."""
    if doming:
        return float(
            mound["suction_depth"] / mound["doming_suction_divisor"] + millimetres / mound["doming_movement_divisor"]
        )
    most = mound["dishing_edge_base"] + millimetres / mound["dishing_movement_divisor"]
    return float(min(mound["dishing_length_share"] * length, most))
