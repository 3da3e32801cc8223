"""The drawing of cracks shows those there are, numbered, in the colours of their categories."""

import numpy as np
import xarray as xr

import damagepred
from damagepred.plotting.cracks import draw_cracks


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
