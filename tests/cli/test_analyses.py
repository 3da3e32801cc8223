"""Commands that compare and print: which measure helps, what a dropped or closed output does, wrong input."""

import json
import re
import subprocess
import sys
import unicodedata
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.archive.files import read_dataset, write_dataset
from damagepred.archive.schema import SCHEMA_VERSION, name_categories
from damagepred.cli import terminal
from damagepred.damage.table import read_table
from damagepred.errors import InputError
from damagepred.inputs.data_files import data_file
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


def test_infer_prints_and_keeps_the_posterior(command: Run, tmp_path: Path) -> None:
    weak = synthetic_study(tmp_path / "weak.dp", 80, medians=(2e-3, 4e-3))
    strong = synthetic_study(tmp_path / "strong.dp", 80, medians=(4e-3, 8e-3))
    survey, kept, picture = (tmp_path / name for name in ("survey.toml", "posterior.nc", "posterior.png"))
    survey.write_text(
        '[[crack]]\nwidth = "2 mm"\nerror = "0.5 mm"\n[prior_odds]\nweak = 2.0\n[discrepancy]\nlevel = "2 mm"\n'
    )
    said = command("infer", weak, strong, survey, "-o", kept, "--plot", picture)
    assert said.code == 0, said.err
    assert "Cause and movement" in said.out
    assert "Damage after further movement" in said.out
    (line,) = [row for row in said.out.splitlines() if row.lstrip("│ ").startswith("width share")]
    assert " to " in line
    assert "derived" in line
    (line,) = [row for row in said.out.splitlines() if row.lstrip("│ ").startswith("level")]
    assert "given" in line
    assert picture.stat().st_size > 10_000
    with xr.open_dataset(kept) as ds:
        assert abs(float(ds["posterior"].sum()) - 1) < 1e-9
        assert ds["cause_prior"].values.tolist() == [0.5, 0.25]
        assert float(ds["another_cause_prior"]) == 0.25
    survey.write_text('[[crack]]\nwidth = "2 mm"\n')
    told = json.loads(command("infer", weak, survey, "--json").out)
    assert told["dims"]["study"] == 1
    # 80 walls of which few agree: the caution comes first, and no odds, neither as such nor as probabilities
    survey.write_text('[[crack]]\nwidth = "12 mm"\nerror = 1e-4\n[discrepancy]\nwidth = 1e-5\nwidth_share = 0.001\n')
    told = json.loads(command("infer", weak, strong, survey, "--json").out)
    assert "cautions" not in told  # sentences go to the error stream
    assert told["data_vars"]["cause_posterior"]["data"] == [None, None]
    assert told["data_vars"]["another_cause_posterior"]["data"] is None
    said = command("infer", weak, strong, survey, "--full")
    assert said.code == 0
    assert said.out.index("caution: ") < said.out.index("Cause and movement")


def test_wrong_input_is_answered_by_a_sentence(command: Run, tmp_path: Path) -> None:
    house = synthetic_study(tmp_path / "house.dp", 20)
    survey = tmp_path / "survey.toml"
    survey.write_text('[[crack]]\nwidth = "2 mm"\n')
    for arguments, sentence in (
        ((house,), "one study folder or more"),
        ((house, house, survey), "a study with a different name"),
        ((tmp_path / "nothing.dp", survey), "no such study folder"),
        ((house, tmp_path / "nothing.toml"), "no such file"),
    ):
        said = command("infer", *arguments)
        assert (said.code, sentence in said.err) == (2, True), said.err
        assert "Traceback" not in said.err


def test_inputs_are_ranked_and_curves_have_other_forms(command: Run, small_study_file: Path, tmp_path: Path) -> None:
    folder = small_study_file.with_suffix(".dp")
    refused = command("sensitivity", small_study_file)
    assert refused.code == 2
    assert "damagepred study" in refused.err
    assert command("study", small_study_file, "-n", 32, "-o", folder).code == 0
    result = command("sensitivity", folder, "--category", 2, "-o", tmp_path / "s.nc", "--plot", tmp_path / "d.png")
    assert result.code == 0, result.err
    assert (tmp_path / "d.png").stat().st_size > 5000
    for words in ("joint.friction", "32 walls", "rank of the capacity for category 2"):
        assert words in re.sub(r"\s+", " ", result.out)
    assert read_dataset(tmp_path / "s.nc")["partial"].dims == ("variable",)
    # and curves of the same folder, in other forms
    for options in (["--model", "common"], ["--model", "empirical"], ["--intensity", "curvature"]):
        result = command("fragility", folder, *options, "--bootstrap", 20, "--plot", tmp_path / "c.png")
        assert result.code == 0, result.err
    again = command("fragility", folder, "--against", "joint.friction", "--categories", 2, "--plot", tmp_path / "s.png")
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


SCENE = """
title = "TITLE"
wall = { length = 0.72, height = 0.3 }
movement = { central_deflection = "0.2 mm", increments = 2 }
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    file = tmp_path / "small.toml"
    file.write_text(SCENE, encoding="utf-8")
    return file


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    program = f"{sys.executable} -m damagepred"
    return subprocess.run(
        ["bash", "-c", command.replace("damagepred", program, 1)], cwd=folder, capture_output=True, text=True
    )


@pytest.mark.thorough
@pytest.mark.parametrize("title", ["[/] [bold]x $x_{$ a & <b>", "=1+1 100 % \\\\frac"])
def test_titles_are_shown_as_they_are(title: str, scene: Path, tmp_path: Path) -> None:
    scene.write_text(SCENE.replace("TITLE", title), encoding="utf-8")
    done = shell("damagepred solve small.toml -o x.nc --plot pictures", tmp_path)
    assert done.returncode == 0, done.stderr
    assert title.replace("\\\\", "\\") in done.stdout


def test_control_characters_reach_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.say("a\x1b[2Jb\nc")
    terminal.table("\x1b]0;t\x07", ["[red]\x9b"], [["[/]\x1b"]])
    said = capsys.readouterr().out
    assert r"a\x1b[2Jb" in said
    assert r"[/]\x1b" in said
    assert all(c.isprintable() or c == "\n" for c in said)


@pytest.mark.parametrize("name", ["=cmd()", "[/]", "$x$", "two\\nlines", ""])
def test_names_of_categories_are_plain(name: str, tmp_path: Path) -> None:
    text = data_file("damage", "as2870.toml").read_text(encoding="utf-8")
    (tmp_path / "own.toml").write_text(text.replace('"negligible"', f'"{name}"', 1), encoding="utf-8")
    with pytest.raises(InputError, match="category name"):
        read_table(tmp_path / "own.toml")


@pytest.mark.parametrize("name", ["mäßig", "très léger 2", "中等", "сильно", "हल्की", "schwer O\u0308"])
def test_names_of_categories_have_letters_of_any_script(name: str, tmp_path: Path) -> None:
    text = data_file("damage", "as2870.toml").read_text(encoding="utf-8")
    (tmp_path / "öwn tafel.toml").write_text(text.replace('"slight"', f'"{name}"', 1), encoding="utf-8")
    table = read_table(tmp_path / "öwn tafel.toml")
    assert table.category_names[2] == unicodedata.normalize("NFC", name)
    ds = xr.Dataset({"damage_category": ("sample", np.array([0, 2], np.int8))})
    name_categories(ds, table.category_names, "own")
    write_dataset(ds.assign_attrs(schema_version=SCHEMA_VERSION), tmp_path / "wänd 1.nc")
    again = read_dataset(tmp_path / "wänd 1.nc")
    assert again.damagepred.category(table.category_names[2]) == 2
    assert len(again["damage_category"].attrs["flag_meanings"].split()) == 5
