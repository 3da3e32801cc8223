"""The picture of a comparison shows the numbers compared."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from damagepred.errors import InputError
from damagepred.plotting import draw_comparison
from damagepred.uq.comparison import compare
from tests.uq.test_comparison import study


def test_lines_are_probabilities_and_their_differences() -> None:
    common = np.random.default_rng(3).standard_normal(80)
    studies = {"as it is": study(0.5, common, movement=(0.005, 0.01)), "stiffer": study(0.2, common)}
    found = compare(studies, categories=[1], at=[0.005, 0.01])
    upper, lower = draw_comparison(found, 1)
    for k, line in enumerate(upper.get_lines()):
        np.testing.assert_allclose(line.get_xdata(), [5.0, 10.0])
        np.testing.assert_allclose(line.get_ydata(), found["probability"][k, 0])
    np.testing.assert_allclose(lower.get_lines()[0].get_ydata(), found["difference"][1, 0])
    assert upper.get_xlabel() == "central deflection (mm)"
    assert "80 pairs" in lower.get_title(loc="left")
    own = plt.subplots(2)[1]
    assert draw_comparison(found, 1, list(own))[0] is own[0]
    with pytest.raises(InputError, match="a comparison of studies"):
        draw_comparison(studies["stiffer"], 1)
