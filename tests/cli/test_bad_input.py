"""Wrong input: exit code 2, one clear message with key, value and remedy, no traceback, nothing overwritten."""

from pathlib import Path

import pytest

from damagepred.errors import InputError
from damagepred.scene import Scene
from damagepred.study import Study
from tests.campaign.test_run import settings
from tests.cli.conftest import Run
from tests.synthetic_studies import synthetic_study

GOOD = """
title = "wall"
wall = { length = 1.44, height = 0.6 }
dpc = { course = 2 }
[movement]
central_deflection = 1e-3
increments = 2
"""

WINDOW = '[[opening]]\nkind = "window"\nx = {x}\ny = 0.15\nwidth = {width}\nheight = {height}\n'

BAD_SCENES = {
    "unknown key": (GOOD.replace("length", "lenght"), ["lenght", "'length'"]),
    "zones in time": (
        GOOD + '[solver]\nabove_dpc = "deformable"\n[dynamics]\nduration = 0.1\n',
        ["above_dpc = 'deformable'", "'elastic'", "leave out [dynamics]"],
    ),
    "thin pier": (GOOD + WINDOW.format(x=0.05, width=0.48, height=0.2), ["pier to its left is 0.05 m", "x", "0.12 m"]),
}


def one_message(result, words: list[str]) -> None:
    assert result.code == 2, (result.out, result.err)
    assert "Traceback" not in result.err
    for word in words:
        assert word in result.err, result.err
    assert len(result.err.strip().splitlines()) <= 2, result.err


@pytest.mark.parametrize("name", BAD_SCENES)
def test_bad_scene(name: str, command: Run, tmp_path: Path) -> None:
    text, words = BAD_SCENES[name]
    file, out = tmp_path / "wall.toml", tmp_path / "wall.nc"
    file.write_text(text)
    out.write_text("precious")
    one_message(command("solve", file, "-o", out), words)
    assert out.read_text() == "precious"


STUDY = """
scene = "wall.toml"
[study]
samples = 2
[variables]
"joint.friction" = { distribution = "uniform", lower = 0.5, upper = 0.8 }
"""

BAD_STUDIES = {
    "no number": (STUDY.replace("0.8", "nan"), ["[variables.joint.friction] upper = nan: must be a finite number"]),
    "unknown key of importance": (
        STUDY + '[study.importance."joint.friction"]\nshft = -1.5\n',
        ["unknown key", "joint.friction", "shft"],
    ),
    "table that is not there": (
        STUDY.split("[variables")[0] + 'sampler = "table"\ntable = "walls.csv"\n',
        ["walls.csv", "no such file"],
    ),
    "unknown place": (STUDY.replace("joint.friction", "joint.fricton"), ["joint.fricton", "'joint.friction'"]),
    "impossible values": (STUDY.replace("lower = 0.5", "lower = -0.5"), ["joint.friction", "at least 0"]),
    "negative samples": (STUDY.replace("samples = 2", "samples = -2"), ["samples", "-2", "at least 1"]),
    "no category to stop at": (
        STUDY.replace("samples = 2", 'stop_at_category = "never"'),
        ["stop_at_category", "never", "1 or more", '"none"'],
    ),
    "scene not there": (STUDY.replace("wall.toml", "wal.toml"), ["wal.toml", "no such file", "'wall.toml'"]),
    "no scene": (STUDY.replace('scene = "wall.toml"', ""), ["no scene", "scene ="]),
    "correlation of a stranger": (
        STUDY + '[correlation]\n"joint.friction" = { "joint.cohesion" = 0.5 }\n',
        ['"joint.friction" with "joint.cohesion" = 0.5', "number of the scene without", '[variables."joint.cohesion"]'],
    ),
    "correlated twice": (
        STUDY
        + '[variables."joint.cohesion"]\ndistribution = "lognormal"\nmean = 1e5\ncov = 0.3\n'
        + '[correlation]\n"joint.friction" = { "joint.cohesion" = 0.5 }\n'
        + '"joint.cohesion" = { "joint.friction" = 0.4 }\n',
        ['"joint.cohesion" with "joint.friction" = 0.4', "given 0.5 before"],
    ),
    "correlation of one value": (
        STUDY
        + '[variables."joint.cohesion"]\ndistribution = "discrete"\nvalues = [1e5]\n'
        + '[correlation]\n"joint.friction" = { "joint.cohesion" = 0.5 }\n',
        ["study.toml", "one single value"],
    ),
}


@pytest.mark.parametrize("name", BAD_STUDIES)
def test_bad_study(name: str, command: Run, tmp_path: Path) -> None:
    text, words = BAD_STUDIES[name]
    (tmp_path / "wall.toml").write_text(GOOD)
    (tmp_path / "study.toml").write_text(text)
    one_message(command("study", tmp_path / "study.toml", "-o", tmp_path / "out.dp"), words)
    assert not (tmp_path / "out.dp").exists()


def test_unreadable_toml(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text("[wall\nlength = 6")
    one_message(command("solve", tmp_path / "wall.toml"), ["not valid TOML", "line 1"])
    (tmp_path / "wall.toml").write_bytes(b"\xff\xfe\x00[wall]")
    one_message(command("solve", tmp_path / "wall.toml"), ["not a text file"])
    one_message(command("solve", tmp_path), ["is a folder"])


def test_no_place_to_write(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(GOOD)
    (tmp_path / "file").write_text("precious")
    one_message(
        command("solve", tmp_path / "wall.toml", "-o", tmp_path / "nowhere" / "wall.nc"), ["does not exist", "wall.nc"]
    )
    one_message(command("solve", tmp_path / "wall.toml", "--plot", tmp_path / "file" / "p"), ["cannot be written"])
    (tmp_path / "study.toml").write_text(STUDY)
    one_message(command("study", tmp_path / "study.toml", "-o", tmp_path / "file" / "out.dp"), ["cannot be written"])
    one_message(command("study", tmp_path / "study.toml", "-o", tmp_path / "file"), ["-o"])
    assert (tmp_path / "file").read_text() == "precious"


def test_a_folder_that_cannot_be_written(command: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No permission, as the system reports it, for a super-user may write all."""
    import os

    (tmp_path / "wall.toml").write_text(GOOD)
    monkeypatch.setattr(os, "access", lambda *_: False)
    one_message(command("solve", tmp_path / "wall.toml", "-o", tmp_path / "wall.nc"), ["wall.nc", "cannot be written"])


REFUSED = (
    "solve wall.toml -o wall; solve wall.toml -o folder.nc; solve wall.toml --plot picture.png; "
    "study study.toml -o study.toml; study study.toml -o house.nc; "
    "rare study.toml --category 1 --at 2mm -o house.html; replay house.dp 0 -o wall; plot wall.nc -o picture.png; "
    "report wall.nc -o report; report wall.nc -o folder; judge wall.nc -o wall.nc; judge -o wall.nc wall.nc; "
    "judge wall.nc -o judged; cracks wall.nc -o cracks; cracks wall.nc --csv cracks.nc; cracks wall.nc -o wall.nc; "
    "scales wall.nc -o scales; scales wall.nc --plot scales; fragility house.dp -o curves; "
    "fragility house.dp --plot curves.txt; fragility house.dp --csv curves; export house.dp walls -o walls; "
    "sensitivity house.dp -o shares; compare a.dp b.dp --category 1 --at 2mm -o found; "
    "infer a.dp survey.toml -o found; design choices.toml -o found; design choices.toml --folder found.nc"
)


@pytest.mark.parametrize("call", REFUSED.split("; "))
def test_an_output_is_refused_before_anything_is_read(call, command, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("wall.toml", "study.toml", "wall.nc", "house.dp", "survey.toml", "choices.toml"):
        Path(name).write_text("this is read too late")
    Path("folder.nc").mkdir()
    Path("folder").mkdir()
    before = sorted(Path().rglob("*"))
    run = command(*call.split())
    one_message(run, [])
    assert any(words in run.err for words in ("must end in", "a folder", "is a file", "is the input")), run.err
    assert sorted(Path().rglob("*")) == before


def test_not_a_study_folder(command: Run, tmp_path: Path) -> None:
    for name in ("status", "fragility"):
        one_message(command(name, tmp_path / "none.dp"), ["no such study folder"])
        one_message(command(name, tmp_path), ["not a study folder"])
    one_message(command("replay", tmp_path, 1), ["not a study folder"])


def test_a_movement_has_a_unit_and_a_category_is_one_of_the_table(command: Run, tmp_path: Path) -> None:
    """50 for 50 mm was 50 m, and category 9 had a probability of 0."""
    house = synthetic_study(tmp_path / "house.dp", 20, medians=(9e-3, 0.02))
    said = command("estimate", house, "--category", 1, "--at", "50")
    assert said.code == 2
    assert "--at 50: give the unit with the number, such as '50 mm' or '50 m'" in said.err
    said = command("estimate", house, "--category", 9, "--at", "2 mm")
    assert (said.code, "categories 1 to 4" in said.err) == (2, True)
    said = command("estimate", house, "--category", 1, "--at", "500 mm")
    assert (said.code, ": unknown, between " in said.out) == (0, True)
    assert "run the study with a larger movement" in said.out


SCENES = {
    "millimetres for metres": ("[wall]\nlength = 6000\n", "length = 6000.0: must be at most 1000 m"),
    "nothing": ("# nothing yet\n", "is empty"),
    "a study": ('scene = "x.toml"\n[study]\nsamples = 3\n', "is a study"),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.timeout(60)
def test_scenes(name: str, tmp_path: Path) -> None:
    text, words = SCENES[name]
    (tmp_path / "wall.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        Scene.from_toml(tmp_path / "wall.toml")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_scene_where_a_study_is_due(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text("[wall]\nlength = 2\n", encoding="utf-8")
    result = command("study", tmp_path / "wall.toml")
    assert result.code == 2
    assert "is a scene; `damagepred solve` solves it" in result.err


@pytest.mark.parametrize("words", [["report"], ["fragility"], ["plot"], ["cracks"], ["judge"]])
def test_a_description_where_a_result_is_due(words: list[str], command: Run, tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text("[wall]\nlength = 2\n", encoding="utf-8")
    result = command(*words, file)
    assert result.code == 2
    assert "is a description, and a result is needed" in result.err
    assert "Errno" not in result.err


@pytest.mark.parametrize("samples", [0, -3, 2.5, True, "3"])
def test_samples_are_a_whole_number(samples: object, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"samples = .*: must be a whole number, 1 or more"):
        Study(settings()).run(tmp_path / "study.dp", samples=samples)
    assert not (tmp_path / "study.dp").exists()


@pytest.mark.timeout(60)
@pytest.mark.parametrize("name", ["solve", "check", "study"])
def test_a_wall_beyond_the_limits_is_refused_at_once(name: str, command: Run, tmp_path: Path) -> None:
    wall = "[scene.wall]" if name == "study" else "[wall]"
    (tmp_path / "wall.toml").write_text(f"{wall}\nlength = 900\nheight = 30\n", encoding="utf-8")
    result = command(name, tmp_path / "wall.toml")
    assert result.code == 2
    assert "would take about" in result.err
    assert "--yes" in result.err
    assert not (tmp_path / "wall.dp").exists()
