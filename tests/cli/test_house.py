"""Commands on a study of small houses: all of them work, count houses, and name walls."""

import re
from pathlib import Path

import pytest

from damagepred import InputError, Study, infer
from tests.campaign.test_house import HOUSE
from tests.cli.conftest import Run

COUNTED = re.compile(
    r"(?<!house of )(?<!of )\b\d+ (sampled |failed |effective )?walls\b|of the walls|wall's own|stored wall"
)
SURVEY = """
[[crack]]
wall = "front"
x = 0.48
y = 0.15
width = "0.2 mm"
[[crack]]
wall = "side"
none = true
"""
CHOICES = """
study = "house.toml"
[target]
at = "40 mm"
category = 2
probability = 0.9
first = 2
most = 2
[[choice]]
name = "front"
[[choice.option]]
name = "as it is"
[[choice.option]]
name = "deeper footing"
cost = 2
scene.footing.depth = "500 mm"
"""
FIT = "--bootstrap 10 --goodness 0"
COMMANDS = f"""
check house.toml --plot check.png --full
status house.dp --full
verify house.dp --samples 1
replay house.dp 0 -o house.nc --plot house --full
solve house.toml
plot house.dp -o study
plot house.nc --gif house.gif
judge house.nc --table bre251 --full
judge house.dp --measure band -o judged.nc
scales house.nc
scales house.dp --plot scales.png
cracks house.nc --csv cracks.csv
fragility house.dp {FIT} --full --plot curves.png -o curves.nc --csv curves.csv
fragility house.dp --wall front {FIT} --categories 1 --export pelicun --extrapolated
fragility house.dp {FIT} --categories 1 --against mound.reach --plot surface.png
compare house.dp again.dp --category 1 --at 40mm --wall front --plot comparison.png
export house.dp walls
export curves.nc curves
export curves.nc openquake --categories 1 --extrapolated
infer house.dp survey.toml -o posterior.nc --plot posterior.png
report house.nc
report house.dp --bootstrap 10
design choices.toml --plot design.png
portfolio street.csv house.toml -n 2 --table street_out.csv --plot street.png
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("houses")
    study = HOUSE.replace("increments = 2", "increments = 6").replace("lower = 1.5, upper", "lower = 0.8, upper")
    (folder / "house.toml").write_text(study)
    (folder / "survey.toml").write_text(SURVEY)
    (folder / "choices.toml").write_text(CHOICES)
    (folder / "street.csv").write_text("name;wall.side.height (m);at\nA;0.3;40 mm\nB;0.45;40 mm\n")
    Study.from_toml(folder / "house.toml").run(folder / "house.dp", samples=10)
    return folder


def test_the_words_of_a_study_count_houses(place: Path, command: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    said = command("study", "house.toml", "-n", 11)
    assert "house.dp: complete, 11 of 11 houses done, 0 failed" in said.out
    assert "11 of 11 houses" in said.err
    assert "houses in 100." in command("estimate", "house.dp", "--category", 1, "--at", "40 mm").out
    said = command("estimate", "house.dp", "--category", 4, "--at", "40 mm", "--wall", "side")
    assert said.out.endswith("none of the walls.\n")
    said = command("sensitivity", "house.dp", "--category", 4)
    assert said.code == 2
    assert "0 of 11 samples reached it, and a ranking of inputs needs 10 or more; run more samples" in said.err
    said = command("fragility", "house.dp", *FIT.split(), "--wall", "front")
    assert "fragility of masonry house: front, against the ground movement at the tree" in said.out


@pytest.mark.thorough
def test_every_command_counts_houses(place: Path, command: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    Study.from_toml(place / "house.toml").run(place / "again.dp", samples=10)
    for line in COMMANDS.strip().splitlines():
        said = command(*line.split())
        assert said.code == 0, f"{line}\n{said.err}"
        if "--wall" not in line:
            assert not COUNTED.search(said.out + said.err), f"{line}\n{said.out}{said.err}"
    page = Path("house_report.html").read_text(encoding="utf-8")
    assert not COUNTED.search(re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL))


def test_a_tilt_that_low_walls_do_not_have_is_refused(place: Path, tmp_path: Path) -> None:
    (survey := tmp_path / "tilt.toml").write_text('[[tilt]]\nwall = "side"\nvalue = 0.002\n')
    with pytest.raises(InputError, match="the archive has no wall_tilt_max; slopes cannot be observed on its walls"):
        infer(place / "house.dp", survey)
