"""Disturbed studies, as in studies/durability: a part by default, all in the slow tests."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def study() -> ModuleType:
    spec = importlib.util.spec_from_file_location("durability_run", ROOT / "studies" / "durability" / "run.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_killed_at_a_random_moment(study: ModuleType, tmp_path: Path) -> None:
    found = study.mistreat(["kill"], walls=4, kills=3, place=tmp_path)
    assert found["kill"].startswith("3 times killed")


@pytest.mark.slow
def test_everything_at_once(study: ModuleType, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    found = study.mistreat(list(study.TREATMENTS), walls=6, kills=3, place=tmp_path)
    assert set(found) == set(study.TREATMENTS)
    assert "parts kept" in found["disk"]


def test_the_comparison_is_sensitive(study: ModuleType, tmp_path: Path) -> None:
    """The comparison detects a single bit, a lost part and an unsolved wall."""
    import numpy as np

    from damagepred.archive.folder import StudyFolder
    from damagepred.archive.parts import read_part, write_part
    from damagepred.campaign.settings import StudySettings
    from damagepred.study import Study
    from tests.conftest import SMALL_STUDY

    (tmp_path / "small.toml").write_text(SMALL_STUDY)
    settings = StudySettings.from_toml(tmp_path / "small.toml")
    from concurrent.futures import ThreadPoolExecutor

    for name in ("a.dp", "b.dp"):
        with ThreadPoolExecutor(1) as executor:
            Study(settings).run(tmp_path / name, samples=2, executor=executor)
    study.same(tmp_path / "a.dp", tmp_path / "b.dp")
    folder = StudyFolder(tmp_path / "b.dp")
    before = study.kept(folder.path)
    part = folder.part_of(1)
    assert part is not None
    columns = read_part(part)
    width = columns["external_work"].values
    width[-1, -1] = np.nextafter(width[-1, -1], np.inf)
    write_part(part, columns, folder.study_hash)
    folder.results_file.unlink()
    with pytest.raises(study.Mistreated, match="external_work differs"):
        study.same(tmp_path / "a.dp", folder.path)
    with pytest.raises(study.Mistreated, match="was lost or changed"):
        study.check_kept(before)
