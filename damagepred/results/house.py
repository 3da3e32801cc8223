"""One wall out of the result of a house."""

from __future__ import annotations

import numpy as np
import xarray as xr

from damagepred.archive.schema import BY_WALL, OF_HOUSE, category_label
from damagepred.errors import InputError, nearest
from damagepred.inputs.arguments import checked
from damagepred.results.tables import Column
from damagepred.scene import House
from damagepred.scene.scene import archived_scene

PLACES = ("block", "contact", "vertex", "opening", "section")


def is_house(ds: xr.Dataset) -> bool:
    """Whether a dataset is the result of a house."""
    return "wall" in ds.dims


def wall_names(ds: xr.Dataset) -> list[str]:
    """Names of the walls of a house."""
    return str(ds["wall"].attrs["flag_meanings"]).split()


def wall_columns(ds: xr.Dataset) -> list[Column]:
    """Cracks, category and corner forces of the walls of a house at the end, one row per wall."""
    cracks, deflection = (1e3 * ds[f"wall_{name}"].values[-1] for name in ("crack_width_max", "central_deflection"))
    categories = [category_label(ds, int(c)).replace(" ", "\u00a0") for c in ds["wall_damage_category"].values[-1]]
    force = np.abs(ds["corner_shear_force"].values[-1])
    sides = np.stack([ds[f"corner_{side}_wall"].values for side in ("first", "second")])
    largest = [1e-3 * force[(sides == w).any(axis=0)].max(initial=0.0) for w in range(ds.sizes["wall"])]
    return [
        Column("wall", wall_names(ds), "", "wall", words=True),
        Column("widest crack", [f"{v:.3f}" for v in cracks], "mm", "widest\ncrack\nmm"),
        Column("category", categories, "", "damage\ncategory", words=True),
        Column("deflection", [f"{v:.2f}" for v in deflection], "mm", "deflection\nof footing\nmm"),
        Column("largest corner shear", [f"{v:.2f}" for v in largest], "kN", "corner\nshear\nkN"),
    ]


@checked
def wall_dataset(ds: xr.Dataset, name: str) -> xr.Dataset:
    """Result of one wall of a house, with the variables of a wall solved alone.

    Energies and diagnostics are of the whole house; the ``scene`` has the ground along the wall as a table.
    """
    if not is_house(ds):
        raise InputError("ds: is the result of one wall; give the result of a house.")
    names = wall_names(ds)
    if name not in names:
        raise InputError(f"wall = '{name}': the house has {', '.join(names)}." + nearest(name, names))
    number = names.index(name)
    places = {dim: np.flatnonzero(ds[f"{dim}_wall"].values == number) for dim in PLACES if f"{dim}_wall" in ds}
    one = ds.isel({**places, "wall": number}, drop=True)
    own = {f"wall_{key}": key for key in BY_WALL if f"wall_{key}" in one}
    one = one.drop_vars([key for key in own.values() if key in one]).rename(own)
    one = one.drop_vars([key for key in OF_HOUSE if key in one.variables])
    empty = [dim for dim in PLACES if dim in one.sizes and one.sizes[dim] == 0]
    one = one.drop_dims(empty)
    for key in ("vertex_block", "contact_interface", "contact_joint"):
        one[key] = one[key] - one[key].min()
    one = one.set_coords([key for key in ("central_deflection", "deflection_ratio") if key in one])
    house = archived_scene(ds.attrs)
    assert isinstance(house, House)
    scene = house.scenes[number]
    return one.assign_attrs(
        scene=scene.to_toml(), title=scene.title, span=scene.wall.length, thickness=scene.wall.thickness
    )
