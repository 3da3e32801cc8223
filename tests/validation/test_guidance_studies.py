"""studies/guidance: settings that make walls, scatter from the tables, shares and their bounds, one quick run."""

import importlib
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from damagepred.assembly import wall_geometry
from damagepred.damage.limits import construction_limits

pytestmark = pytest.mark.quick_cases()

ROOT = Path(__file__).resolve().parents[2]
GUIDANCE = ROOT / "studies" / "guidance"
STUDIES = ("construction", "dpc", "joints", "bond", "openings", "size")
OURS = ("room", "tables", "drawing", "curves")


def module(name: str) -> ModuleType:
    sys.path.insert(0, str(GUIDANCE))
    try:
        for own in OURS:
            sys.modules.pop(own, None)
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(GUIDANCE))
        for own in OURS:
            sys.modules.pop(own, None)


@pytest.mark.parametrize("name", STUDIES)
def test_every_variant_is_a_wall_and_differs_from_the_others(name: str) -> None:
    room = module("room")
    _, variants = room.read_variants(GUIDANCE / name)
    assert len(variants) >= 4
    archives = {room.archive_of(Path(), room.study_of(v.settings, "doming", None, 1.0)) for v in variants}
    assert len(archives) == len(variants)
    for variant in variants:
        scene = variant.settings.scene
        assert len(wall_geometry(scene).joints.kind) > 100
        # as far as the most that AS 2870 allows under masonry
        assert scene.movement.central_deflection == pytest.approx(scene.wall.length / 400, rel=1e-9)
        if scene.opening:
            assert scene.loads.roof in (0.0, pytest.approx(3000 * scene.wall.length))


def quick(name: str, tmp_path: Path, samples: int) -> pd.DataFrame:
    room = module("room")
    folder = tmp_path / name
    asked = f"--samples {samples} --workers 1 --increments 1 --reach 0.2 --archives {tmp_path} --output {folder}"
    assert room.run_study(GUIDANCE / name, asked.split()) == 0
    assert (folder / "damage.png").stat().st_size > 10_000
    return pd.read_csv(folder / "table.csv")


@pytest.mark.slow
def test_a_whole_study_in_its_quick_form(tmp_path: Path) -> None:
    """The command that writes a page's table and picture; `size` has the smallest walls."""
    rows = quick("size", tmp_path, 1)
    assert set(rows["movement"]) == {"dishing", "doming"}


@pytest.mark.parametrize("name", STUDIES)
def test_readmes_show_the_committed_tables(name: str) -> None:
    tables = module("tables")
    rows = pd.read_csv(GUIDANCE / name / "table.csv")
    assert tables.markdown(rows) in (GUIDANCE / name / "README.md").read_text(encoding="utf-8")
    variants = module("room").read_variants(GUIDANCE / name)[1]
    assert list(dict.fromkeys(rows["variant"])) == [v.name for v in variants]
    curves = pd.read_csv(GUIDANCE / name / "curves.csv")
    assert list(dict.fromkeys(curves["variant"])) == [v.name for v in variants]
    text = (GUIDANCE / name / "README.md").read_text(encoding="utf-8")
    if "<!-- curves" in text:
        assert module("curves").markdown_of_curves(curves) in text


def test_curves_agree_with_shares() -> None:
    """Of a hundred walls whose capacities are lognormal."""
    curves, tables = module("curves"), module("tables")
    capacity = 6.0 * np.exp(0.4 * np.random.default_rng(1).standard_normal(100))
    deflection = np.broadcast_to(np.arange(31) * 0.5e-3, (100, 31))
    category = (1e3 * deflection >= 0.2 * capacity[:, None]).astype(np.int8) + (1e3 * deflection >= capacity[:, None])
    both = ("sample", "increment")
    ds = xr.Dataset(
        {
            "damage_category": (both, category.astype(np.int8)),
            "deflection_ratio": (both, deflection / 6.0),
            "status": ("sample", np.zeros(100, dtype=np.int8)),
        },
        coords={"central_deflection": (both, deflection)},
    )
    fitted = curves.fits_of([tables.Case("one", "dishing", ds)])
    rows = curves.rows_of_curves(fitted, construction_limits())
    second = rows[(rows["category"] == 2) & (rows["limit"] == "L/800")].iloc[0]
    share = (capacity < 7.5).mean()
    assert second["lower"] < share < second["upper"]
    assert abs(second["probability"] - share) < 0.08
    assert second["median lower (mm)"] < 6.0 < second["median upper (mm)"]
    third = rows[rows["category"] == 3].iloc[0]
    assert third["fit"] == "never reached"
    assert "| one | dishing | 3 | | | | | never reached |" in curves.markdown_of_curves(rows)
