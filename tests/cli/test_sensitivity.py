"""What damage depends on, and fragility in its other forms, as a user types it."""

import re
from pathlib import Path

from damagepred.archive.files import read_dataset
from tests.cli.conftest import Run


def test_inputs_are_ranked_and_curves_have_other_forms(command: Run, small_study_file: Path, tmp_path: Path) -> None:
    folder = small_study_file.with_suffix(".dp")
    refused = command("sensitivity", small_study_file)
    assert refused.code == 2
    assert "damagepred study" in refused.err
    assert command("study", small_study_file, "-n", 24, "-o", folder).code == 0
    result = command("sensitivity", folder, "--category", 2, "-o", tmp_path / "s.nc", "--plot", tmp_path / "d.png")
    assert result.code == 0, result.err
    assert (tmp_path / "d.png").stat().st_size > 5000
    for words in ("joint.friction", "24 walls", "rank of the capacity for category 2"):
        assert words in re.sub(r"\s+", " ", result.out)
    assert read_dataset(tmp_path / "s.nc")["partial"].dims == ("variable",)
    # and curves of the same folder, in other forms
    for options in (["--model", "common"], ["--model", "empirical"], ["--intensity", "curvature"]):
        result = command("fragility", folder, *options, "--bootstrap", 20, "--plot", tmp_path / "c.png")
        assert result.code == 0, result.err
    again = command(
        "fragility", folder, "--against", "joint.friction", "--categories", "2", "--plot", tmp_path / "s.png"
    )
    assert again.code == 0, again.err
    assert "joint.friction" in again.out
    assert (tmp_path / "s.png").stat().st_size > 5000
    for bad, words in (
        (("fragility", folder, "--against", "joint.friction"), "a surface is of one category"),
        (("fragility", folder, "--against", "joint.frictoin", "--categories", "2"), "Did you mean"),
        (("sensitivity", folder, "--of", "crack"), "no such result"),
        (("sensitivity", folder, "--category", 4, "--of", "crack_width_max"), "give one of them"),
    ):
        result = command(*bad)
        assert result.code == 2, result.out
        assert words in result.err
