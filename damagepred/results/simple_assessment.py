"""The simple methods, to compare the model of bricks and joints with: damage from the ground's movement alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray, Int8Array
from damagepred.damage.deep_beam import beam_strain
from damagepred.damage.limits import load_movement_limits, load_strain_table
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.scene import Scene
from damagepred.scene.scene import archived_scene

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["SimpleVerdict", "angular_distortion", "simple_categories", "simple_category", "simple_methods"]


class SimpleVerdict(NamedTuple):
    """Category of a wall by its limiting tensile strain; arrays of the shape of the deflection ratio."""

    # of the deep beam (1), tension positive
    bending_strain: FloatArray
    diagonal_strain: FloatArray
    category: Int8Array  # by the larger of the two; 4 stands for 4 and 5, -1 for an unknown movement (NaN)


@checked
def simple_category(scene: Scene, deflection_ratio: ArrayLike | None = None) -> SimpleVerdict:
    """Category by the limiting tensile strain of a deep beam that follows the ground, see ``damage.deep_beam``.

    Openings, joints and dpc do not count. E/G is 2 (1 + nu); ``damage.beam_strain`` takes another, and ground strains.
    """
    ratio = _own_ratio(scene) if deflection_ratio is None else deflection_ratio
    wall, nu = scene.wall, scene.block.poisson_ratio
    strain = beam_strain(ratio, wall.length, wall.height, scene.bending, 2 * (1 + nu), poisson_ratio=nu)
    return SimpleVerdict(strain.bending, strain.diagonal, load_strain_table().by_strain(strain.largest))


@checked
def simple_categories(ds: xr.Dataset) -> xr.Dataset:
    """Judge every increment of a solved wall, or of all walls of a study, by the limiting tensile strain.

    Parameters
    ----------
    ds : xarray.Dataset
        Of ``damagepred.solve`` or ``damagepred.open_study``; its ``deflection_ratio`` is read, and its scene.

    Returns
    -------
    xarray.Dataset
        ``bending_strain``, ``diagonal_strain`` and ``simple_category``, of the shape of ``deflection_ratio``.

    Raises
    ------
    InputError
        If the dataset has no scene, or its walls differ in length, height or Poisson's ratio.

    Examples
    --------
    >>> import damagepred
    >>> found = damagepred.simple_categories(damagepred.open_study("house.dp"))
    >>> int(found["simple_category"].max())
    4
    >>> found["simple_category"].dims
    ('sample', 'increment')
    """
    if "scene" not in ds.attrs or "deflection_ratio" not in ds.variables:
        raise InputError(
            "the dataset has no scene or no 'deflection_ratio'; it needs the result of a scene or a study."
        )
    for place in ("wall.length", "wall.height", "block.poisson_ratio"):
        if place in ds.variables:
            raise InputError(f"'{place}' differs from wall to wall; judge each wall by simple_category.")
    ratio = ds["deflection_ratio"]
    scene = archived_scene(ds.attrs)
    found = simple_category(scene, ratio.values)
    table = load_strain_table()
    about = "of a deep beam that follows the ground"
    values = {
        "bending_strain": (found.bending_strain, {"units": "1", "long_name": f"bending strain {about}"}),
        "diagonal_strain": (found.diagonal_strain, {"units": "1", "long_name": f"diagonal strain {about}"}),
        "simple_category": (found.category, {"long_name": f"damage category {about}, by {table.name}"}),
    }
    return xr.Dataset(
        {name: (ratio.dims, *value) for name, value in values.items()},
        coords={name: ds[name] for name in ("deflection_ratio", "central_deflection") if name in ds.variables},
    )


@checked
def angular_distortion(scene: Scene, deflection_ratio: float | None = None) -> float:
    """Return the largest slope of the ground relative to the line through the ends of the wall (1)."""
    ratio = _own_ratio(scene) if deflection_ratio is None else float(deflection_ratio)
    movement, length = scene.movement, scene.wall.length
    if movement.settles:
        own = movement.measures(scene.wall)
        return ratio * own["angular_distortion"] / (own["deflection_ratio"] or np.inf)
    if not movement.prescribed or movement.central_deflection == 0:
        return 4 * ratio
    x = np.linspace(0.0, length, 4001)
    y = movement.profile(x, length)
    slope = float(np.abs(np.gradient(y - np.interp(x, [0.0, length], y[[0, -1]]), x, edge_order=2)).max())
    return slope * ratio / (movement.central_deflection / length)


@checked
def simple_methods(scene: Scene, deflection_ratio: float | None = None) -> pd.DataFrame:
    """Return the verdicts of the simple methods: a row for each limit, and whether the movement exceeds it.

    Parameters
    ----------
    scene : Scene
        The wall and its movement.
    deflection_ratio : float, optional
        Central deflection over length (1); by default of the scene's movement, if it is prescribed.

    Returns
    -------
    pandas.DataFrame
        Columns ``method``, ``about`` (what lies beyond the limit), ``measure``, ``value``, ``limit`` (both 1),
        ``exceeded`` and ``confidence`` in the limit.

    Raises
    ------
    InputError
        If the footing of the scene finds its own form and no deflection ratio is given.

    Examples
    --------
    >>> import damagepred
    >>> scene = damagepred.Scene.from_toml("wall.toml")
    >>> table = damagepred.simple_methods(scene, deflection_ratio=1 / 500)
    >>> table[["about", "exceeded"]].head(3)
            about  exceeded
    0  category 1      True
    1  category 2      True
    2  category 3      True
    """
    import pandas as pd

    ratio = _own_ratio(scene) if deflection_ratio is None else float(deflection_ratio)
    verdict = simple_category(scene, ratio)
    table = load_strain_table()
    strain = float(max(verdict.bending_strain, verdict.diagonal_strain))
    method, rows = f"limiting tensile strain ({table.source})", []
    for number, limit in enumerate(table.limits, start=1):
        exceeded = bool(verdict.category >= number)
        rows.append((method, f"category {number}", "tensile_strain", strain, limit, exceeded, table.confidence))
    values = {"deflection_ratio": ratio, "angular_distortion": angular_distortion(scene, ratio)}
    for known in load_movement_limits():
        if known.kind in (None, scene.bending):
            value, limit = values[known.measure], known.value(scene.wall.length, scene.wall.height)
            exceeded = value > limit * (1 + 1e-12)
            rows.append((known.author, known.about, known.measure, value, limit, exceeded, known.confidence))
    return pd.DataFrame(rows, columns=["method", "about", "measure", "value", "limit", "exceeded", "confidence"])


def _own_ratio(scene: Scene) -> float:
    if not scene.movement.prescribed:
        raise InputError(
            f"movement.shape = '{scene.movement.shape}': the footing finds its own form, so its deflection is not "
            "known beforehand; give deflection_ratio, for instance of the solved wall."
        )
    if scene.movement.settles:
        return scene.movement.measures(scene.wall)["deflection_ratio"]
    return scene.movement.central_deflection / scene.wall.length
