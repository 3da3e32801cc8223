"""One lookup of levels: rounding at a limit, unknown values, and the side to which a limit belongs."""

import numpy as np
import pytest

from damagepred.damage import deviation_limits, load_strain_table, load_table, sticking_limits
from damagepred.damage.limits import load_scale

SCALES = {
    "width": (load_table("as2870").by_width, load_table("as2870").limits),
    "psi": (load_scale("psi").level, load_scale("psi").limits),
    "slope": (deviation_limits().level, deviation_limits().limits),
    "sticking": (lambda angle: sticking_limits().level(angle, 0.0 * angle, 0.0 * angle), sticking_limits().angle),
}


@pytest.mark.parametrize("name", SCALES)
def test_what_is_unknown_has_no_level(name: str):
    level, limits = SCALES[name]
    assert level(np.array([np.nan, 2.0 * limits[-1]])).tolist() == [-1, len(limits)]


def test_a_strain_that_meets_a_limit_has_the_category_below():
    table = load_strain_table()
    strain = np.array(table.limits)
    assert table.by_strain(strain).tolist() == [0, 1, 2, 3]
    assert table.by_strain(strain * (1 + 1e-10)).tolist() == [0, 1, 2, 3]
    assert table.by_strain(strain * (1 + 1e-6)).tolist() == [1, 2, 3, 4]
    assert table.by_strain([np.nan]).tolist() == [-1]
