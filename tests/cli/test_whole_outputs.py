"""Whole outputs of commands on invented results, line by line, against the lists in ``outputs/``."""

import re
from pathlib import Path

import pytest

from damagepred.archive.files import write_dataset
from damagepred.cli import terminal
from tests.cli.conftest import Run
from tests.plotting.test_whole_pictures import solved
from tests.recorded import check
from tests.synthetic_studies import synthetic_study

LISTS = Path(__file__).parent / "outputs"

COMMANDS = {
    "status": "status part.dp",
    "status_full": "status part.dp --json",
    "estimate": "estimate part.dp --category 1",
    "estimate_at": "estimate house.dp --category slight --at H1",
    "estimate_json": "estimate part.dp --category 2 --json --confidence 0.8",
    "compare": "compare house.dp weak.dp --category 1 --at 4mm",
    "compare_json": "compare house.dp weak.dp --category 2 --json",
    "fragility": "fragility part.dp --bootstrap 30 --goodness 20 --full",
    "fragility_common": "fragility house.dp --model common --bootstrap 0 --goodness 0 --categories 1,2",
    "fragility_empirical": "fragility part.dp --model empirical --bootstrap 30 --intensity deflection_ratio",
    "fragility_by_band": "fragility house.dp --measure band --bootstrap 0 --goodness 0 --full",
    "surface": "fragility house.dp --categories 1 --against joint.friction --bootstrap 0 --goodness 0",
    "sensitivity": "sensitivity house.dp --category 1 --full",
    "sensitivity_json": "sensitivity part.dp --category 2 --json",
    "scales": "scales door.nc",
    "scales_full": "scales history.nc --full",
    "cracks": "cracks door.nc",
    "cracks_full": "cracks broken.nc --full --increment 1",
    "cracks_json": "cracks pier.nc --json",
    "judge": "judge door.nc --table bre251 -o again.nc",
    "judge_study": "judge house.dp --plasterboard -o again.nc",
    "judge_full": "judge history.nc --measure band --full -o again.nc",
    "judge_gauge": "judge door.nc --measure band --band-gauge 0.3m --group-distance 0.4m --no-groups -o again.nc",
    "materials": "materials",
    "materials_json": "materials --json",
    "new": "new wall.toml",
    "new_template": "new wall.toml --template tree",
    "help": "--help",
    "wrong_category": "estimate house.dp --category sligt",
    "wrong_movement": "estimate house.dp --category 1 --at 500mm",
    "wrong_file": "plot huose.dp",
}


@pytest.mark.parametrize("name", COMMANDS)
def test_an_output_is_its_list(name: str, command: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(terminal._out, "_width", 80)
    words = COMMANDS[name].split()
    synthetic_study(Path("house.dp"), 24)
    if "part.dp" in words:
        synthetic_study(Path("part.dp"), 24, failed=(3, 7), missing=(20, 21), medians=(1e-3, 2e-3, 6e-3))
    if "weak.dp" in words:
        synthetic_study(Path("weak.dp"), 24, medians=(2.5e-3, 5e-3))
    for word in words:
        if word.endswith(".nc") and word != "again.nc":
            write_dataset(solved(word.removesuffix(".nc")), Path(word))
    result = command(*words)
    text = f"{result.code}\n{result.out}{result.err}".replace(str(tmp_path), "")
    text = re.sub(r'\d+\.\d+\.\d+\S*|[0-9a-f]{12,}\+?|(?<=_commit": ")\w+', "VERSION", text)
    lines = text.splitlines()
    check(LISTS / f"{name}.txt", lines if len(lines) < 100 else [" ".join(text.split())])
