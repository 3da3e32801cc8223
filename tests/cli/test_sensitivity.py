"""What damage depends on, and fragility in its other forms, as a user types it."""

import re
from pathlib import Path

import pytest

from damagepred.archive.files import read_dataset
from damagepred.archive.folder import open_study
from tests.cli.conftest import Run


@pytest.fixture
def crossed(command: Run, small_study_file: Path) -> Path:
    result = command("sensitivity", small_study_file, "-n", 24)
    assert result.code == 0, result.err
    return small_study_file.with_suffix(".crossed.dp")


def test_of_a_study_file_crossed_walls_are_run(command: Run, crossed: Path, tmp_path: Path) -> None:
    assert int(open_study(crossed).attrs["crossed"]) == 1
    result = command("sensitivity", crossed, "--category", 2, "-o", tmp_path / "s.nc", "--plot", tmp_path / "d.png")
    assert result.code == 0, result.err
    assert (tmp_path / "d.png").stat().st_size > 5000
    for words in (
        "joint.friction",
        "one value a",  # joint, on another line of the table
        "6 tables",
        "rank of the capacity for category 2",
    ):
        assert words in re.sub(r"\s+", " ", result.out)
    assert read_dataset(tmp_path / "s.nc")["group_total"].dims == ("group",)
    # and curves of the same folder, in other forms
    for options in (
        ["--model", "common"],
        ["--model", "empirical"],
        ["--band", "profile"],
        ["--intensity", "curvature"],
    ):
        result = command("fragility", crossed, *options, "--bootstrap", 20, "--plot", tmp_path / "c.png")
        assert result.code == 0, result.err
    again = command(
        "fragility", crossed, "--against", "joint.friction", "--categories", "2", "--plot", tmp_path / "s.png"
    )
    assert again.code == 0, again.err
    assert "joint.friction" in again.out
    assert (tmp_path / "s.png").stat().st_size > 5000
    for bad, words in (
        (("fragility", crossed, "--against", "joint.friction"), "a surface is of one category"),
        (("fragility", crossed, "--against", "joint.frictoin", "--categories", "2"), "Did you mean"),
        (("sensitivity", crossed, "--of", "crack"), "no such result"),
        (("sensitivity", crossed, "--category", 4, "--of", "crack_width_max"), "give one of them"),
    ):
        result = command(*bad)
        assert result.code == 2, result.out
        assert words in result.err
