"""What programs read: --json, --quiet, --version and completion; and a study file where one wall is solved."""

import json
from pathlib import Path

import pytest
import xarray as xr

from damagepred import __version__, compare, open_study
from damagepred.analyses import rare_event
from damagepred.analyses.epistemic import alternatives
from damagepred.campaign.settings import StudySettings
from damagepred.campaign.status import study_status
from damagepred.errors import InputError
from tests.cli.conftest import Run
from tests.cli.test_commands import SMALL_SCENE
from tests.synthetic_studies import synthetic_study

SMALL_STUDY = f"""
[study]
samples = 4
[scene]
{SMALL_SCENE}
[variables]
"joint.tensile_strength" = {{ distribution = "lognormal", mean = "0.4 MPa", cov = 0.3, field = {{}} }}
"dpc.friction" = {{ distribution = "uniform", lower = 0.4, upper = 0.8 }}
"""


def test_version(command: Run) -> None:
    said = command("--version")
    assert (said.code, said.out) == (0, f"damagepred {__version__}\n")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell: str, command: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_DAMAGEPRED_COMPLETE", f"complete_{shell}")
    monkeypatch.setenv("COMP_WORDS", "damagepred frag")
    monkeypatch.setenv("COMP_CWORD", "1")
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", "damagepred frag")
    monkeypatch.setenv("_TYPER_COMPLETE_FISH_ACTION", "get-args")
    assert "fragility" in command().out


def test_json_of_a_study_is_what_python_returns(command: Run, tmp_path: Path) -> None:
    house = synthetic_study(tmp_path / "house.dp", 40, medians=(2e-3, 4e-3))
    status = json.loads(command("status", house, "--json").out)
    shares = study_status(house).categories
    assert status["total"] == status["done"] == 40
    assert not {"lines", "cautions"} & set(status)
    assert [c["or_worse"] for c in status["categories"]] == [c.or_worse for c in shares]
    estimate = json.loads(command("estimate", house, "--category", 1, "--at", "3 mm", "--json").out)
    assert (estimate["movement"], estimate["at"], estimate["alternatives"][0]["name"]) == (3e-3, "3 mm", None)
    known = alternatives(house, 1, 3e-3)[0].found.estimate
    assert estimate["alternatives"][0]["found"]["estimate"]["value"] == known.value
    said = command("fragility", house, "--bootstrap", 20, "--goodness", 0, "--json", "-o", tmp_path / "curves.nc")
    curves = xr.Dataset.from_dict(json.loads(said.out))
    assert "wrote" in said.err
    with xr.open_dataset(tmp_path / "curves.nc") as kept:
        assert curves["median"].astype(float).identical(kept["median"])
        assert set(kept.variables) == set(curves.variables)


def test_json_of_a_wall_and_of_its_cost(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SMALL_SCENE)
    cost = json.loads(command("check", tmp_path / "wall.toml", "--json").out)
    assert cost["increments"] == 3
    assert [text for text in cost.values() if isinstance(text, str) and " " in text] == [cost["title"]]
    quiet = command("solve", tmp_path / "wall.toml", "-o", tmp_path / "wall.nc", "--quiet")
    assert quiet.code == 0
    assert "wrote" not in quiet.out
    assert "small wall" in quiet.out
    found = json.loads(command("cracks", tmp_path / "wall.nc", "--json").out)
    assert found
    assert {"crack_width", "crack_part", "central_deflection"} <= set(found[0])


def test_comparisons_and_sensitivity_are_printed_as_json(command: Run, tmp_path: Path) -> None:
    a, b = (synthetic_study(tmp_path / f"{name}.dp", 40, medians=(2e-3, 7e-3)) for name in "ab")
    said = command("compare", a, b, "--category", "slight", "--at", "3 mm", "--json")
    compared = xr.Dataset.from_dict(json.loads(said.out))
    known = compare({"a": open_study(a), "b": open_study(b)}, categories=[2], at=[3e-3])
    assert compared["probability"].values == pytest.approx(known["probability"].values)
    said = command("sensitivity", a, "--category", 1, "--json")
    assert xr.Dataset.from_dict(json.loads(said.out)).sizes["variable"] >= 1
    own = xr.Dataset.from_dict(json.loads(command("sensitivity", a, "--category", 2, "--at", "site", "--json").out))
    assert own.attrs["output"] == "damage of category 2 at each sample's own movement"
    refused = command("sensitivity", a, "--at", "8 mm")
    assert (refused.code, "--at 8 mm: must be site" in refused.err) == (2, True)


def test_a_quiet_estimate_of_a_rare_event_prints_its_result_alone(command: Run, tmp_path: Path) -> None:
    (tmp_path / "house.toml").write_text(SMALL_STUDY)
    options = "--category 1 --at 0.3mm -n 20 --level-share 0.25 --runs 1"
    rare = ("rare", tmp_path / "house.toml", *options.split())
    loud = command(*rare, "-o", tmp_path / "loud.rare")
    quiet = command(*rare, "-o", tmp_path / "quiet.rare", "--quiet")
    assert "level reached" in loud.out
    assert quiet.out.splitlines() == [line for line in loud.out.splitlines() if not line.startswith("level reached")]


def test_a_new_folder_of_a_rare_event_has_200_samples_per_level_and_5_runs(
    command: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, samples: int, runs: int, **__: object) -> None:
        raise InputError(f"{samples} samples, {runs} runs")

    monkeypatch.setattr(rare_event, "rare_event", refuse)
    (tmp_path / "house.toml").write_text(SMALL_STUDY)
    rare = ("rare", tmp_path / "house.toml", "--category", 1, "--at", "0.3mm")
    assert "200 samples, 5 runs" in command(*rare).err
    assert "20 samples, 5 runs" in command(*rare, "-n", 20).err


def test_solve_takes_the_mean_wall_of_a_study(command: Run, tmp_path: Path) -> None:
    (tmp_path / "house.toml").write_text(SMALL_STUDY)
    said = command("solve", tmp_path / "house.toml", "-o", tmp_path / "wall.nc")
    assert said.code == 0, said.err
    sentence = next(line for line in said.out.splitlines() if "its mean wall" in line)
    assert "joint.tensile_strength = 0.4 MPa, dpc.friction = 0.6," in sentence
    assert "the movement as given" in sentence
    assert "one wall without scatter; sampled walls may be worse: run `damagepred study house.toml`" in said.out
    with xr.open_dataset(tmp_path / "wall.nc") as wall:
        assert wall.attrs["title"] == f"{StudySettings.from_toml(tmp_path / 'house.toml').title}: mean wall"
        assert float(wall["contact_tensile_strength"][wall["contact_kind"].values < 2].max()) == pytest.approx(4e5)


def test_export_is_a_command(command: Run, tmp_path: Path) -> None:
    house = synthetic_study(tmp_path / "house.dp", 40, medians=(2e-3, 4e-3))
    for form, names in (("pelicun", ["house_pelicun.csv", "house_pelicun.json"]), ("walls", ["house_walls.csv"])):
        said = command("export", house, form, "--categories", 1)
        assert (said.code, said.out) == (0, "".join(f"wrote {tmp_path / name}\n" for name in names)), said.err
        assert all((tmp_path / name).stat().st_size for name in names)
    curves = tmp_path / "curves.nc"
    assert command("fragility", house, "--categories", 1, "--bootstrap", 20, "--goodness", 0, "-o", curves).code == 0
    assert command("export", curves, "curves", "-o", tmp_path / "mine.csv").code == 0
    assert (tmp_path / "mine.csv").read_text().startswith("category,intensity,")
    assert command("export", curves, "curves").code == 0  # beside it, under its name
    assert (tmp_path / "curves_curves.csv").read_bytes() == (tmp_path / "mine.csv").read_bytes()
    refused = command("export", curves, "curves", "-o", tmp_path / "mine.nc")
    assert (refused.code, refused.out) == (2, "")
    assert f"mine.nc: the name must end in .csv or .xml; write {tmp_path / 'mine.csv'}." in refused.err
    assert not (tmp_path / "mine.nc").exists()
    assert command("export", curves, "openquake", "-o", tmp_path / "model.xml").code == 0
    assert (tmp_path / "model.xml").stat().st_size
