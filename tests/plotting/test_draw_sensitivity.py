import numpy as np
import pytest

from damagepred.analyses.variance_shares import study_sensitivity
from damagepred.errors import InputError
from damagepred.plotting import draw_sensitivity
from tests.analyses.test_variance_shares import crossed_walls


def test_inputs_are_drawn_with_their_intervals():
    ds = crossed_walls(60, 0.4, 0.2)
    ds["dpc.friction"] = ("sample", np.random.default_rng(3).standard_normal(240), {"role": "input"})
    found = study_sensitivity(ds, category=1, resamples=30)
    left, right = draw_sensitivity(found)
    assert [t.get_text() for t in left.get_yticklabels()] == ["dpc, friction", "joint, friction"]  # strongest on top
    assert left.get_xlabel() == "rank correlation"
    points = left.lines[0].get_xdata()
    assert points == pytest.approx(found["spearman"].sel(variable=["dpc.friction", "joint.friction"]).values)
    assert "120 walls" in left.get_title(loc="left")
    order = ["dpc.friction", "joint.friction"]
    for ax, shown in (
        (left, [("spearman", {"variable": order}), ("partial", {"variable": order})]),
        (right, [("first_order", {"variable": order})]),
    ):
        assert len(ax.containers) == len(shown)
        for points, (name, of) in zip(ax.containers, shown):
            value, low, high = (found[f"{name}{end}"].sel(of).values for end in ("", "_lower", "_upper"))
            assert points.lines[0].get_xdata() == pytest.approx(value)
            (bars,) = points.lines[2]
            ends = np.array([segment[:, 0] for segment in bars.get_segments()])
            np.testing.assert_allclose(ends, np.column_stack((np.minimum(low, value), np.maximum(high, value))))
        bottom, top = ax.get_ylim()
        assert all(bottom < y < top for points in ax.containers for y in points.lines[0].get_ydata())
    assert right.get_xlabel() == "share of the variance"


def test_other_datasets_are_refused():
    ds = crossed_walls(30, 0.4, 0.2)
    with pytest.raises(InputError, match="study_sensitivity"):
        draw_sensitivity(ds)
