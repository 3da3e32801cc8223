"""A study made by the first version of the archive is read, resumed and extended."""

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.archive.folder import StudyFolder, open_study
from damagepred.archive.schema import SCHEMA_VERSION
from damagepred.archive.versions import MIGRATIONS, brought_up_to_date
from damagepred.campaign.status import study_status
from damagepred.errors import InputError, StudyError
from damagepred.study import Study

OLD = Path(__file__).parent / "version_1"
"""Written by version 1: two solved samples, and one that took too long."""


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return Path(shutil.copytree(OLD, tmp_path / "old.dp"))


def test_there_is_a_way_from_every_version() -> None:
    assert set(MIGRATIONS) == set(range(1, SCHEMA_VERSION))


@pytest.mark.parametrize(
    ("attrs", "violation", "newton", "cycles"),
    [
        ({"solver_method": "quasi_static"}, None, [[2, 9], [3, -1]], [[0, 0], [0, -1]]),
        ({"solver_method": "explicit"}, None, [[0, 0], [0, -1]], [[2, 9], [3, -1]]),
        ({"solver_method": "dynamic"}, None, [[0, 0], [0, -1]], [[2, 9], [3, -1]]),
        ({}, [[0.0, 0.0], [np.nan, np.nan]], [[2, 9], [0, -1]], [[0, 0], [3, -1]]),
    ],
)
def test_cycles_of_version_4_are_split_by_the_solver(
    attrs: dict[str, str], violation: list[list[float]] | None, newton: list[list[int]], cycles: list[list[int]]
) -> None:
    both = ("sample", "increment")
    ds = xr.Dataset({"cycles": (both, np.array([[2, 9], [3, -1]]))}, attrs=attrs)
    if violation is not None:
        ds["joint_law_violation"] = both, violation
    now = brought_up_to_date(4, "old.nc", ds)
    assert now["newton_iterations"].values.tolist() == newton
    assert now["cycles"].values.tolist() == cycles
    assert "Newton" in now["newton_iterations"].attrs["long_name"]
    assert "Newton" not in now["cycles"].attrs["long_name"]


@pytest.mark.parametrize("dims", [("increment",), ("sample", "increment")])
def test_the_widest_crack_so_far_of_version_6_has_its_name_of_today(dims: tuple[str, ...]) -> None:
    values = np.ones((2,) * len(dims))
    now = brought_up_to_date(6, "old.nc", xr.Dataset({"worst_crack_width": (dims, values, {"units": "m"})}))
    assert list(now.data_vars) == ["crack_width_worst"]
    assert now["crack_width_worst"].values.tolist() == values.tolist()
    assert now["crack_width_worst"].attrs["units"] == "m"


def test_an_old_study_is_extended_and_its_parts_are_left(old: Path) -> None:
    before = {p.name: p.read_bytes() for p in (old / "parts").iterdir()}
    archived, mixed = open_study(old), study_status(old).cautions
    study = Study.from_folder(old)
    with ThreadPoolExecutor(1) as executor:
        with pytest.raises(StudyError, match=r"were solved by an older version .* with --mix-versions"):
            study.run(old, samples=4, executor=executor)
        assert study_status(old).cautions == mixed
        summary = study.run(old, samples=4, executor=executor, mix_versions=True)
    assert any("walls were solved by 2 programs" in line for line in study_status(old).cautions)
    assert (summary.done, summary.failed) == (4, 1)
    for name, content in before.items():
        assert (old / "parts" / name).read_bytes() == content
    assert StudyFolder(old).manifest()["schema_version"] == SCHEMA_VERSION  # an older program must not write any more
    ds = open_study(old)
    assert ds["status"].values.tolist() == [0, 0, 2, 0]
    np.testing.assert_array_equal(ds["crack_width_max"].values[:2], archived["crack_width_max"].values[:2])
    # solved by today's program it is the same but for the steps: the movement at which a bond breaks is found to 1 % of
    # its strength
    with ThreadPoolExecutor(1) as executor:
        study.run(old.with_name("new.dp"), samples=2, executor=executor)
    new = open_study(old.with_name("new.dp"))
    np.testing.assert_allclose(new["crack_width_max"].values, ds["crack_width_max"].values[:2], rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize(
    ("version", "words"),
    [
        (
            SCHEMA_VERSION + 1,
            f"schema version {SCHEMA_VERSION + 1}, this damagepred reads up to {SCHEMA_VERSION}; update",
        ),
        ("2", "has no schema_version"),
        (None, "has no schema_version"),
    ],
)
def test_a_study_of_another_age_is_refused_before_anything_is_written(old: Path, version: object, words: str) -> None:
    manifest = {**StudyFolder(old).manifest(), "schema_version": version}
    (old / "manifest.json").write_text(json.dumps(manifest))
    before = {p: p.read_bytes() for p in old.rglob("*") if p.is_file()}
    study = Study.from_folder(OLD)
    for attempt in (lambda: open_study(old), lambda: study.run(old, samples=5)):
        with pytest.raises(InputError, match=words):
            attempt()
    assert {p: p.read_bytes() for p in before} == before
