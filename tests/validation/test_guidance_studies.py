"""studies/guidance: settings that make walls, scatter from the tables, shares and their bounds, one quick run."""

from pathlib import Path

import pandas as pd
import pytest

from damagepred.assembly import wall_geometry
from studies.guidance import run

pytestmark = pytest.mark.quick_cases()


@pytest.mark.parametrize("name", run.NAMES)
def test_every_variant_is_a_wall_and_differs_from_the_others(name: str) -> None:
    _, variants = run.read_variants(run.HERE / name)
    assert len(variants) >= 4
    archives = {run.archive_of(Path(), run.study_of(v, "doming", None, 1.0)) for v in variants.values()}
    assert len(archives) == len(variants)
    for settings in variants.values():
        scene = settings.scene
        assert len(wall_geometry(scene).joints.kind) > 100
        # as far as the most that AS 2870 allows under masonry
        assert scene.movement.central_deflection == pytest.approx(scene.wall.length / 400, rel=1e-9)
        if scene.opening:
            assert scene.loads.roof in (0.0, pytest.approx(3000 * scene.wall.length))


@pytest.mark.slow
def test_a_whole_study_in_its_quick_form(tmp_path: Path) -> None:
    """The command that writes a page's table and picture; `size` has the smallest walls."""
    asked = f"size --samples 1 --workers 1 --increments 1 --reach 0.2 --output {tmp_path}"
    assert run.main(asked.split()) == 0
    assert (tmp_path / "size" / "damage.png").stat().st_size > 10_000
    assert set(pd.read_csv(tmp_path / "size" / "table.csv")["movement"]) == {"dishing", "doming"}


@pytest.mark.parametrize("name", run.NAMES)
def test_readmes_show_the_committed_tables(name: str) -> None:
    rows = pd.read_csv(run.HERE / name / "table.csv")
    assert run.markdown(rows) in (run.HERE / name / "README.md").read_text(encoding="utf-8")
    assert list(dict.fromkeys(rows["variant"])) == list(run.read_variants(run.HERE / name)[1])
