from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.plotting import draw, draw_wall
from damagepred.plotting.geometry import Deformed, footing_blocks, footing_rise, ground_profile
from damagepred.plotting.sheet import plain_number
from damagepred.scene import Footing, Mound


def collection(ax, label):
    return [c for c in ax.collections if c.get_label() == label]


def arrows(ax):
    return [t for t in ax.texts if getattr(t, "arrow_patch", None) is not None]


def words(ax):
    return [t.get_text() for t in ax.texts]


def test_a_wall_on_jacks_is_drawn_with_segments_supports_and_jacks(on_jacks):
    ax = draw_wall(on_jacks, increment=1)
    (segments,) = collection(ax, "footing")
    (bricks,) = collection(ax, "bricks")
    assert isinstance(segments, PolyCollection)
    assert len(segments.get_paths()) == (on_jacks.block_y.values < 0).sum()
    assert len(bricks.get_paths()) == (on_jacks.block_y.values > 0).sum()
    load = float(on_jacks.jack_load[1])
    assert len(arrows(ax)) == on_jacks.sizes["jack"]
    for arrow in arrows(ax):  # they push up
        assert (arrow.xy[1] > arrow.xyann[1]) == (load > 0)
    low, length = float(on_jacks.vertex_y.min()), float(np.ptp(on_jacks.vertex_x.values))
    triangles = [patch.get_xy()[[0, 3, 2]] for patch in ax.patches if patch.get_label() == "support"]
    assert [corners[0, 0] for corners in triangles] == pytest.approx(on_jacks.support_x.values)
    for corners in triangles:  # under the footing, as wide on either side
        assert corners[0, 1] == pytest.approx(low, abs=0.05 * length)
        half = corners[2, 0] - corners[0, 0]
        assert 0 < half == pytest.approx(corners[0, 0] - corners[1, 0])
        assert corners[1, 1] == corners[2, 1] < corners[0, 1]
    kilonewtons = [float(t.removesuffix(" kN")) for t in words(ax) if t.endswith(" kN")]
    drawn = [*on_jacks.support_load.values[1], load, load, load]
    assert kilonewtons == pytest.approx(np.array(drawn) / 1e3, abs=0.006)


def test_a_wall_on_a_mound_is_drawn_with_the_surface_of_the_ground(on_mound):
    factor = 3.0
    ax = draw_wall(on_mound, exaggeration=factor)
    (line,) = [line for line in ax.lines if line.get_label().startswith("surface")]
    x, height, rise = ground_profile(on_mound, -1, ContactKind.SOIL)
    depth = Footing(depth=0.05).depth
    assert height == pytest.approx(np.full(len(x), -depth))
    # about the footing under dead load, and not above its underside, which the ground carries
    footing = footing_blocks(on_mound)
    datum = float(footing_rise(on_mound, 0, footing)[1].mean())
    under = np.interp(x, *footing_rise(on_mound, -1, footing))
    assert datum < 0.0
    assert (rise > under).any()
    np.testing.assert_allclose(line.get_ydata(), height + factor * (np.minimum(rise, under) - datum))
    told = f"datum: top of footing under dead load, settled by {plain_number(-1e3 * datum)} mm"
    assert told in [text.get_text() for text in ax.get_legend().get_texts()]
    assert "at a surface movement of " in ax.get_title(loc="left")
    shape = Deformed.of(on_mound, 0, 1000.0).shape  # under dead load the footing lies on the datum
    assert shape[:, 1].min() == pytest.approx(-depth, abs=1e-4)
    # that is the mound's own formula
    own = Mound().profile(x, 1.2, "doming")
    assert np.ptp(own) > 1e-3
    np.testing.assert_allclose(rise, own, atol=1e-6)
    assert not arrows(ax)


def test_the_footing_goes_where_the_archive_says(on_jacks):
    x, rise = footing_rise(on_jacks, -1, footing_blocks(on_jacks))
    assert (np.diff(x) > 0).all()
    middle, ends = np.interp(0.6, x, rise), (rise[0] + rise[-1]) / 2
    assert ends - middle == pytest.approx(float(on_jacks.central_deflection[-1]), rel=1e-9)
    ax = draw(on_jacks, "footing_rise")
    assert ax.lines[-1].get_ydata() == pytest.approx(1e3 * rise)


def test_what_has_no_footing_is_refused(on_dpc):
    with pytest.raises(InputError, match="variable = 'footing_rise'"):
        draw(on_dpc, "footing_rise")
    with pytest.raises(InputError, match="variable = 'jack_load'"):
        draw(on_dpc, "jack_load")
