"""`damagepred compare` says which measure helps, and answers wrong input by a sentence."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from tests.cli.conftest import Run
from tests.synthetic_studies import synthetic_study


def test_two_studies_of_the_same_samples(command: Run, tmp_path: Path) -> None:
    weak = synthetic_study(tmp_path / "weak.dp", 40, medians=(2e-3, 4e-3))
    strong = synthetic_study(tmp_path / "strong.dp", 40, medians=(4e-3, 8e-3))
    curve, picture = tmp_path / "difference.nc", tmp_path / "difference.png"
    said = command("compare", weak, strong, "--category", 1, "--at", "3 mm", "-o", curve, "--plot", picture)
    assert said.code == 0, said.err
    assert said.out.splitlines()[0] == "P(category >= 1 at 3 mm)"
    assert "less damage; 40 pairs of samples" in said.out
    assert picture.stat().st_size > 10_000
    with xr.open_dataset(curve) as ds:
        assert float(ds["difference"].isel(study=1, category=0).min()) < -0.2
