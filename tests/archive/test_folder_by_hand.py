"""Contents of a study folder, and their writing, sample by sample."""

import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from damagepred.archive import provenance
from damagepred.archive.folder import StudyFolder
from damagepred.archive.parts import joined, write_part
from damagepred.archive.schema import Column
from damagepred.errors import ArchiveWarning
from tests.archive.test_files import row
from tests.synthetic_studies import synthetic_study


def test_names_of_parts_and_failures(tmp_path: Path) -> None:
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 40, failed=(7, 23)))
    assert folder.part_file(7) == folder.part_file(7, 7) == folder.parts / "sample-00000007.nc"
    assert folder.part_file(7, 12) == folder.parts / "samples-00000007-00000012.nc"
    assert folder.failure_file(23) == folder.failures / "sample-00000023.json"
    for first, last in ((0, 0), (3, 5), (7, 7)):
        folder.part_file(first, last).touch()
    (folder.parts / "sample-00000009.nc.bak").touch()
    (folder.failures / "notes.json").touch()
    assert set(folder.part_files().values()) == {range(1), range(3, 6), range(7, 8)}
    assert folder.finished() == {0, 3, 4, 5, 7}
    assert [folder.part_of(i) for i in (2, 3, 5, 6, 7)] == [
        None,
        folder.part_file(3, 5),
        folder.part_file(3, 5),
        None,
        folder.part_file(7),
    ]
    assert folder.failed_samples() == {7, 23}
    folder.forget_failures(set())
    assert folder.results_file.exists()
    folder.forget_failures({7})
    assert (folder.failed_samples(), folder.finished(), folder.results_file.exists()) == ({23}, {0, 3, 4, 5}, False)


def test_requests_to_stop_and_what_a_kill_leaves_are_tidied(tmp_path: Path) -> None:
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 4))
    assert not folder.stopping
    folder.ask_to_stop()
    assert folder.stopping
    left = [place / ".x.tmp" for place in (folder.path, folder.parts, folder.failures)]
    for file in left:
        file.touch()
    folder.tidy()
    assert not folder.stopping
    assert not any(file.exists() for file in left)


def test_where_a_folder_may_begin(tmp_path: Path) -> None:
    folder = StudyFolder(tmp_path / "house.dp")
    assert folder._can_begin()
    for place in (folder.parts, folder.failures):
        place.mkdir(parents=True)
    (folder.path / ".manifest.json.1.tmp").touch()
    (folder.path / "manifest.json").touch()
    assert folder._can_begin()
    for file in (folder.parts / "a", folder.failures / "a", folder.path / "letter.txt", folder.path / ".tmp"):
        file.touch()
        assert not folder._can_begin(), file
        file.unlink()
    assert folder._can_begin()
    assert not StudyFolder(folder.path / "manifest.json")._can_begin()


def test_results_of_samples_solved_failed_and_missing(tmp_path: Path) -> None:
    """0 and 1 in one part, 3 failed on its way and left a part, 4 failed without one, 2 and 5 are not run."""
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 6, failed=(3, 4)))
    folder.results_file.unlink()
    rows = [row(i, increments=7, openings=0) for i in range(4)]
    for one, status in zip(rows, (0, 1, 0, 2)):
        one["status"].values[:] = status
    write_part(folder.part_file(0, 1), joined(rows[:2]), folder.study_hash)
    write_part(folder.part_file(3), rows[3], folder.study_hash)
    ds = folder.results()
    assert ds["status"].values.tolist() == [0, 1, 3, 2, 2, 3]
    assert ds.attrs["samples_failed"] == 2
    for sample in (0, 1, 3):
        for name in ("crack_width_max", "damage_category", "run_time"):
            np.testing.assert_array_equal(ds[name].values[sample], rows[sample][name].values[0])
    for sample in (2, 4, 5):
        assert np.isnan(ds["crack_width_max"].values[sample]).all()
        assert (ds["damage_category"].values[sample] == -1).all()
    np.testing.assert_array_equal(ds["joint.friction"], folder.design()["joint.friction"])
    folder.part_file(3).rename(folder.part_file(5))
    other = joined([rows[0], rows[2]])  # 0 and 2 in a part that says 0 and 1
    write_part(folder.part_file(0, 1), other, folder.study_hash)
    with pytest.warns(ArchiveWarning, match="does not hold the samples that its name says"):
        assert folder.results()["status"].values.tolist() == [3, 3, 3, 2, 2, 3]
    write_part(folder.part_file(0, 1), joined(rows[:2]), folder.study_hash)
    folder.part_file(5).unlink()
    few = folder.results(["crack_width_max"])
    assert {"crack_width_max", "status", "joint.friction"} <= set(few.data_vars)
    assert not {"damage_category", "run_time"} & set(few.data_vars)


def test_the_commit_is_that_of_the_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[str]] = []
    told = SimpleNamespace(stdout="0123456789ab+\n")

    def run(command: list[str], **how: object) -> SimpleNamespace:
        asked.append(command)
        assert how["check"]
        assert how["capture_output"]
        if told.stdout == "fail":
            raise subprocess.TimeoutExpired(command, 10)
        return told

    monkeypatch.setattr(provenance.subprocess, "run", run)
    commit = provenance.package_commit.__wrapped__
    assert commit() == "0123456789ab+"
    root = Path(asked[0][2])
    assert (root / "damagepred" / "archive" / "provenance.py").is_file()
    for told.stdout in ("\n", "fail"):
        assert commit() == "unknown"
    monkeypatch.setattr(provenance, "version", lambda name: {"numpy": "1", "scipy": "2", "numba": "3"}[name])
    assert provenance.environment.__wrapped__()["libraries"].split(", ", 1)[1] == "numpy 1, scipy 2, numba 3"


def test_environments_of_parts_become_one_table(tmp_path: Path) -> None:
    """A solved 0 and 5, B solved 2, of 1 nothing is known; rows of each part's own table are those of all then."""
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 6))
    folder.results_file.unlink()
    a, b = ({**provenance.environment(), "machine": name} for name in "AB")
    for sample, table, place in ((0, [a], 0), (1, [b], -1), (2, [a, b], 1), (5, [b, a], 1)):
        one = row(sample, increments=7, openings=0)
        one["status"].values[:] = 0
        one["environment"] = Column(("sample",), np.array([place]), provenance.as_table(table))
        write_part(folder.part_file(sample), one, folder.study_hash)
    for _ in range(2):  # from the parts, and from the file of all
        ds = folder.results()
        table = provenance.from_table(ds["environment"].attrs)
        found = [table[k]["machine"] if k >= 0 else "?" for k in ds["environment"].values[[0, 1, 2, 5]]]
        assert (found, table) == (["A", "?", "B", "A"], [a, b])
        known = provenance.programs(ds)
        assert known[provenance.program(a)] == 3
        assert sum(known.values()) == 4
        folder.consolidate()


def test_a_part_that_is_newer_than_a_failure_counts(tmp_path: Path) -> None:
    """The file of all samples has 1 failed and 3 not run; both have been run since, and 2 has not."""
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 4, failed=(1,), missing=(2, 3)))
    whole = folder.results()
    assert whole["status"].values.tolist() == [0, 2, 3, 3]
    for sample, status in ((0, 1), (1, 0), (3, 1)):  # what is known of 0 is not read again
        one = row(sample, increments=7, openings=0)
        one["status"].values[:] = status
        write_part(folder.part_file(sample), {k: one[k] for k in ("sample", "status", "run_time")}, folder.study_hash)
    ds = folder.results(["run_time"])
    assert ds["status"].values.tolist() == [0, 0, 3, 1]
    assert ds["run_time"].values[[0, 1, 3]].tolist() == [0.25, *(row(i)["run_time"].values[0] for i in (1, 3))]
    assert "damage_category" not in ds
    folder.results_file.write_bytes(b"CDF")
    with pytest.warns(ArchiveWarning, match=r"results\.nc.* Parts are read instead\."):
        assert folder.results()["status"].values.tolist() == [1, 0, 3, 1]
    folder.results_file.unlink()
    folder.part_file(3).rename(folder.part_file(2))
    with pytest.warns(ArchiveWarning, match=r"sample-00000002\.nc.* It is left out\."):
        assert folder.results()["status"].values.tolist() == [1, 0, 3, 3]
