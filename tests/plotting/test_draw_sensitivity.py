import pytest

from damagepred.errors import InputError
from damagepred.plotting import draw_sensitivity
from tests.analyses.test_variance_shares import crossed_walls


def test_other_datasets_are_refused():
    ds = crossed_walls(30, 0.4, 0.2)
    with pytest.raises(InputError, match="study_sensitivity"):
        draw_sensitivity(ds)
