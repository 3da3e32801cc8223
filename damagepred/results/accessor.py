"""Methods of this package on datasets: ``ds.damagepred``. ``damagepred`` imports this file when xarray is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import xarray as xr

from damagepred.errors import nearest

if TYPE_CHECKING:
    from damagepred.uq.exceedance import Exceedance
    from damagepred.uq.movement_distribution import MovementDistribution


@xr.register_dataset_accessor("damagepred")
class DatasetAccessor:
    """Methods on the dataset of a study, of curves or of a house."""

    def __init__(self, ds: xr.Dataset) -> None:
        self._ds = ds

    def __getattr__(self, name: str) -> xr.DataArray:
        """Return a variable, even if a method of datasets has its name, such as ``median`` of curves."""
        if name.startswith("_"):  # pickle asks for them before there is a dataset
            raise AttributeError(name)
        if name in self._ds.variables:
            return self._ds[name]
        raise AttributeError(f"this dataset has no variable '{name}'." + nearest(name, map(str, self._ds.variables)))

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *map(str, self._ds.variables)]

    def wall(self, name: str) -> xr.Dataset:
        """Return the result of one wall of a house, or of a study of houses, as of a wall alone."""
        from damagepred.results.house import wall_dataset

        return wall_dataset(self._ds, name)

    def category(self, name: str) -> int:
        """Return the number of a damage category, such as 2 for "slight"."""
        from damagepred.uq.capacity import category_number

        return category_number(self._ds, name)

    def sel(self, category: int | str) -> xr.Dataset:
        """Return one category, by number or name, of a dataset of curves or a comparison."""
        from damagepred.uq.capacity import category_number

        return self._ds.sel(category=category_number(self._ds, category))

    def exceedance(
        self, category: int | str, at: float | str | MovementDistribution, *, confidence: float = 0.9
    ) -> Exceedance:
        """Probability of a category or worse at a movement, see ``damagepred.exceedance``."""
        from damagepred.uq.exceedance import exceedance

        return exceedance(self._ds, category, at, confidence=confidence)
