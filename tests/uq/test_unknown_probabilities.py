"""Unknown probabilities are not estimated, and estimates include the weights of walls."""

import numpy as np
import pytest

from damagepred.analyses.epistemic import Alternative
from damagepred.cli.sentences import estimate_lines
from damagepred.errors import InputError
from damagepred.uq.exceedance import exceedance, median_movement
from damagepred.uq.fragility import fit_surface
from tests.uq.test_stopping import study

CAPACITY = np.array([0.0035, 0.0065, 0.0125, 0.03])


def test_no_estimate_beyond_the_largest_movement() -> None:
    found = exceedance(study(np.full(20, 0.5)), 1, 0.5)
    assert np.isnan(found.estimate.value)
    assert (found.estimate.lower, found.estimate.upper) == (0.0, 1.0)
    assert (found.failed_undamaged, found.failed_damaged, found.not_followed) == (0.0, 1.0, 20)
    (said,) = estimate_lines([Alternative("", found, 20.0)], 1, 0.5)
    assert "at 500 mm) is unknown, between 0 and 1" in said


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("begun", [False, True])
def test_unknown_names_are_refused_in_all_branches(single: bool, begun: bool) -> None:
    ds = study(np.linspace(0.001, 0.03, 30))
    ds["surface_movement"] = 1.5 * ds["central_deflection"]  # on a mound another measure was read without a message
    if single:
        ds = ds.isel(increment=-1)
    if not begun:
        ds = ds.drop_vars("damage_category")
    with pytest.raises(InputError, match="no variable 'typo'"):
        exceedance(ds, 1, 0.007, intensity="typo")
    with pytest.raises(InputError, match="no variable 'typo'"):
        median_movement(ds, 1, intensity="typo")


def test_categories_beyond_the_table_are_refused() -> None:
    ds = study(CAPACITY)
    for category in (0, 2, 9):
        message = f"category = {category}: .* categories 1 to 1"
        with pytest.raises(InputError, match=message):
            exceedance(ds, category, 0.007)
        with pytest.raises(InputError, match=message):
            median_movement(ds, category)
        with pytest.raises(InputError, match=message):
            exceedance(ds.isel(increment=-1), category, 0.007)
        with pytest.raises(InputError, match=message):
            fit_surface(ds, category, "weight")
