"""A study as a table of its walls."""

import numpy as np
import xarray as xr

from damagepred.exports import walls_frame


def test_walls_frame_has_a_row_a_wall_with_the_worst_of_its_path() -> None:
    path = ("sample", "increment")
    ds = xr.Dataset(
        {
            "status": ("sample", np.array([0, 1, 2, 3], dtype=np.int8)),
            "joint.friction": ("sample", np.array([0.7, 0.8, 0.9, 0.6])),
            "joint.cohesion": (("sample", "joint"), np.ones((4, 5))),
            "damage_category": (path, np.array([[0, 1, 1], [0, 2, 4], [0, -1, -1], [-1, -1, -1]], dtype=np.int8)),
            "crack_width_max": (path, np.array([[0, 2e-3, 1e-3], [0, 4e-3, 0.1], [0, np.nan, np.nan], [np.nan] * 3])),
        },
        coords={"central_deflection": (path, np.tile([0.0, 4e-3, 8e-3], (4, 1)))},
    )
    frame = walls_frame(ds)
    assert list(frame["status"]) == ["complete", "collapsed", "failed", "missing"]
    assert list(frame["joint.friction"]) == [0.7, 0.8, 0.9, 0.6]
    assert "joint.cohesion" not in frame
    assert list(frame["damage_category"]) == [1, 4, 0, -1]
    assert np.array_equal(frame["crack_width_max"], [2e-3, 0.1, 0.0, np.nan], equal_nan=True)
    assert list(frame["central_deflection_max"]) == [8e-3] * 4
