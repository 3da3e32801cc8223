"""The drawing of cracks shows those there are, numbered, in the colours of their categories."""

import numpy as np
import xarray as xr

import damagepred
from damagepred.plotting.cracks import _row, cracks_sheet, draw_cracks, widest_of_each_part
from damagepred.results.wall_cracks import crack_frame


def test_the_dpc_is_drawn_apart(on_dpc: xr.Dataset):
    ax = draw_cracks(on_dpc)
    assert "dpc open" in [c.get_label() for c in ax.collections]
    assert "deflection of 6 mm" in ax.get_title(loc="left")


def test_every_number_of_the_sheet(cracked: xr.Dataset):
    """Each column is the variable that its head names, in its unit; a synthetic row has different values in all."""
    frame = widest_of_each_part(crack_frame(damagepred.cracks(cracked)))
    cells = cracks_sheet(cracked).axes[1].tables[0].get_celld()
    names = {
        "width\n(mm)": "crack_width",
        "normal to its\nline (mm)": "crack_width_normal",
        "opening and\nslip (mm)": "crack_displacement",
        "began\nat (mm)": "first_central_deflection",  # which drives this wall
    }
    heads = [cells[0, column].get_text().get_text() for column in range(9)]
    for row, one in enumerate(frame.to_dict("records"), start=1):
        for column, head in enumerate(heads):
            if head in names:
                assert cells[row, column].get_text().get_text() == f"{1e3 * one[names[head]]:.2f}"
    made_up = {
        "crack": 7,
        "crack_part": "below_dpc",
        "crack_width": 1.23e-3,
        "crack_width_normal": 0.98e-3,
        "crack_displacement": 1.57e-3,
        "crack_length": 0.64,
        "crack_orientation": "stepped",
        "crack_inclination": 32.4,
        "crack_branches": 2,
        "crack_length_through_blocks": 0.1,
        "crack_x": 2.25,
        "crack_y": 0.75,
    }
    told = ["7", "below dpc", "1.23", "0.98", "1.57", "0.64", "stepped, 32°, 2 branches, bricks", "2.25, 0.75", "4.50"]
    assert _row(made_up, 4.5e-3) == told
    level = made_up | {"crack_orientation": "horizontal", "crack_branches": 1, "crack_length_through_blocks": 0.0}
    assert _row(level, 0.0)[6] == "horizontal, 1 branch"
    assert _row(level | {"crack_branches": 0}, 0.0)[6] == "horizontal"


def test_the_legend_names_the_categories_that_are_drawn(cracked: xr.Dataset):
    ax = draw_cracks(cracked)
    opening = damagepred.crack_profile(cracked)["piece_opening"].values
    names = ["below 0.1 mm", "from 0.1 mm", "from 1 mm", "from 5 mm", "from 15 mm"]
    found = np.unique(np.searchsorted(np.array([0.1, 1.0, 5.0, 15.0]) * 1e-3, opening, side="right"))
    assert len(found) > 1
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert [words for words in told if "category" in words] == [f"{names[c]} (category {c})" for c in found]
    assert "open or slid by more than 0.05 mm" in ax.get_title(loc="left").replace("\n", " ")
    timed = cracked.assign_coords(time=("increment", 0.25 * np.arange(cracked.sizes["increment"])))
    assert "cracks at 0.75 s" in draw_cracks(timed).get_title(loc="left")


def test_before_anything_has_cracked_it_says_so(cracked: xr.Dataset):
    start = cracked.isel(increment=[0])
    assert "nothing has opened" in cracks_sheet(start).axes[1].texts[0].get_text()
