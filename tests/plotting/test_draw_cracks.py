"""The drawing of cracks shows those there are, numbered, in the colours of their categories."""

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.colors import to_rgba

import damagepred
from damagepred.plotting.categories import COLOURS
from damagepred.plotting.cracks import cracks_sheet, draw_cracks, widest_of_each_part
from damagepred.wall_cracks import crack_frame


def collection(ax, label: str):
    return next(c for c in ax.collections if c.get_label() == label)


def test_every_piece_is_drawn_in_the_colour_of_its_category(cracked: xr.Dataset):
    ax = draw_cracks(cracked)
    profile = damagepred.crack_profile(cracked)
    lines = collection(ax, "cracks")
    assert len(lines.get_segments()) == profile.sizes["piece"]
    wide = np.sort(profile["piece_opening"].values)
    limits = np.array([0.1, 1.0, 5.0, 15.0]) * 1e-3
    expected = [to_rgba(COLOURS[c]) for c in np.searchsorted(limits, wide, side="right")]
    assert [tuple(c) for c in lines.get_colors()] == expected
    numbers = {text.get_text() for text in ax.texts}
    assert numbers == {str(n) for n in widest_of_each_part(crack_frame(damagepred.cracks(cracked)))["crack"]}


def test_the_dpc_is_drawn_apart(on_dpc: xr.Dataset):
    ax = draw_cracks(on_dpc)
    assert "dpc open" in [c.get_label() for c in ax.collections]
    assert "deflection of 6 mm" in ax.get_title(loc="left")


def test_the_sheet_bears_a_table(cracked: xr.Dataset, on_dpc: xr.Dataset):
    for ds in (cracked, on_dpc):
        lower = cracks_sheet(ds).axes[1]
        frame = crack_frame(damagepred.cracks(ds))
        cells = lower.tables[0].get_celld()
        assert cells[1, 0].get_text().get_text() == str(frame["crack"][0])
        assert cells[1, 2].get_text().get_text() == f"{1e3 * frame['crack_width'][0]:.2f}"
        assert max(row for row, _ in cells) == len(widest_of_each_part(frame))


def test_of_each_part_the_widest_are_shown():
    part = ["wall"] * 10 + ["dpc_slip"] * 3
    frame = pd.DataFrame({"crack": range(13), "crack_part": part})
    assert widest_of_each_part(frame)["crack"].tolist() == [0, 1, 2, 3, 4, 5, 6, 7, 10, 11]


def test_before_anything_has_cracked_it_says_so(cracked: xr.Dataset):
    start = cracked.isel(increment=[0])
    assert "nothing has opened" in cracks_sheet(start).axes[1].texts[0].get_text()
