"""The drawing of cracks shows those there are, numbered, in the colours of their categories."""

import numpy as np
import xarray as xr

import damagepred
from damagepred.plotting.cracks import cracks_sheet, draw_cracks, widest_of_each_part
from damagepred.results.tables import Table, crack_columns
from damagepred.results.wall_cracks import crack_frame


def test_the_sheet_has_the_rows_of_the_table_of_cracks(cracked: xr.Dataset):
    listed = Table.brief("", crack_columns(widest_of_each_part(crack_frame(damagepred.cracks(cracked)))))
    cells = cracks_sheet(cracked).axes[1].tables[0].get_celld()
    for row, texts in enumerate([listed.columns, *listed.rows]):
        assert [cells[row, column].get_text().get_text() for column in range(len(texts))] == list(texts)


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
