"""Mistaken files and numbers: the message names the probable intention, before any model is built."""

from pathlib import Path

import pytest

from damagepred.errors import InputError
from damagepred.scene import Scene
from damagepred.study import Study
from tests.campaign.test_run import settings
from tests.cli.conftest import Run

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
        Study(settings()).run(tmp_path / "study.dp", samples=samples)  # type: ignore[arg-type]
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
