"""The drawing of cracks shows those there are, numbered, in the colours of their categories."""

import xarray as xr

import damagepred
from damagepred.plotting.cracks import cracks_sheet, widest_of_each_part
from damagepred.results.tables import Table, crack_columns
from damagepred.results.wall_cracks import crack_frame


def test_the_sheet_has_the_rows_of_the_table_of_cracks(cracked: xr.Dataset):
    listed = Table.brief("", crack_columns(widest_of_each_part(crack_frame(damagepred.cracks(cracked)))))
    cells = cracks_sheet(cracked).axes[1].tables[0].get_celld()
    for row, texts in enumerate([listed.columns, *listed.rows]):
        assert [cells[row, column].get_text().get_text() for column in range(len(texts))] == list(texts)


def test_before_anything_has_cracked_it_says_so(cracked: xr.Dataset):
    start = cracked.isel(increment=[0])
    assert "nothing has opened" in cracks_sheet(start).axes[1].texts[0].get_text()
