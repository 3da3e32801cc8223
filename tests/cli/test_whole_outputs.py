"""Whole outputs of commands on invented results, line by line, against the lists in ``outputs/``."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damagepred.analyses.epistemic import Alternative
from damagepred.analyses.limit_state import Question
from damagepred.analyses.rare_event import RareEvent
from damagepred.archive.files import write_dataset
from damagepred.campaign.cost_estimate import CostEstimate
from damagepred.campaign.status import StudyStatus
from damagepred.cli import terminal
from damagepred.cli.sentences import comparison_lines, cost_lines, estimate_lines, rare_lines, status_lines, zones_lines
from damagepred.uq.estimate import Estimate
from damagepred.uq.exceedance import Exceedance
from damagepred.uq.subset import Level, SubsetEstimate
from tests.cli.conftest import Run
from tests.plotting.test_whole_pictures import comparison, solved
from tests.recorded import check
from tests.synthetic_studies import synthetic_study

LISTS = Path(__file__).parent / "outputs"

COMMANDS = {
    "status": "status part.dp",
    "status_full": "status part.dp --json",
    "estimate": "estimate part.dp --category 1",
    "estimate_at": "estimate house.dp --category slight --at H1",
    "estimate_json": "estimate part.dp --category 2 --json --confidence 0.8",
    "estimate_all": "estimate house.dp --at 5mm",
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
    monkeypatch.setattr(terminal._out(), "_width", 80)
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


def test_sentences_are_their_list() -> None:
    lines: list[str] = []
    cost: dict[str, Any] = {name: number for number, name in enumerate(CostEstimate.__dataclass_fields__, 1)}
    cost |= {"title": "house", "wall_seconds": 1.5, "compile_seconds": 70.0, "matrix_bytes": 2_500_000}
    cost |= {"wall": "a wall", "moving": "ground", "sampled": ("a", "b"), "method": "quasi-static"} | {
        "status": "complete"
    }
    cost |= {"cautions": ("mind",), "accuracy": ("fast: 1 %",), "ground": "clay", "site": "H1", "timed": (1.0, 2.0)}
    for more in ({}, {"variables": 0, "timed": (), "zones": 0, "matrix_bytes": 0}, {"variables": 0, "peak_bytes": 0}):
        for full in (False, True):
            lines += cost_lines(CostEstimate(**cost | more), full)
    state: dict[str, Any] = {"title": "house", "total": 30, "done": 20, "failed": 2, "remaining": 8}
    state |= {"wall_seconds": 2.5, "effective_walls": 11.4, "limits": [3e-3, 5e-3], "categories": []} | {
        "cautions": ["mind"]
    }
    state["failures"] = [(4, "diverged", "no equilibrium")]
    state |= {name: None for name in StudyStatus.__dataclass_fields__ if name not in state}
    none = {"wall_seconds": np.nan, "effective_walls": np.nan, "limits": [], "remaining": 0, "cautions": []} | {
        "failures": []
    }
    for status in (StudyStatus(**state), StudyStatus(**state | none), StudyStatus(**state | {"remaining": 0})):
        lines += status_lines(status)
    for value in (0.125, np.nan):
        e = Estimate(value, 0.03, 0.08, 0.19, 0.9, 40, 30.0)
        found = Exceedance(e, **dict(zip(Exceedance._fields[1:], (3, 0.1, 0.2, 5))))
        other = Alternative("dry", found._replace(estimate=e._replace(value=0.3)), 7.0)
        wet = Alternative("wet", found._replace(estimate=e._replace(value=0.05)), 12.0)
        lines += estimate_lines([Alternative("", found, 40.0), other, wet], 2, "8 mm")
        lines += estimate_lines([Alternative("", found._replace(not_followed=0), 40.0)], 2, "8 mm", True)
    levels = (Level(3e-3, 0.1, 0.2, np.nan), Level(1e-3, 0.12, 0.3, 0.45))
    subset = SubsetEstimate(2e-3, 0.3, 1e-3, 4e-3, 0.9, levels, 900, True, np.empty((0, 2)), np.empty(0))
    below = subset._replace(reached=False)
    for result in (
        RareEvent(subset, subset._replace(probability=5e-3, upper=9e-3), 4, 10, ("a 1", "b 2")),
        RareEvent(below._replace(runs=(1e-3, 3e-3)), below, 0, 0, ("a 1",)),
    ):
        lines += rare_lines(result, Question(category=3, at=0.012))
    studies = comparison()
    studies["difference"][2, :, 1] = np.nan
    lines += comparison_lines(studies, 1, 0.004)
    studies["paired_samples"][1] = 0
    studies["difference_upper"][:] = -0.01
    lines += comparison_lines(studies, 3, 0.008)
    studies["probability"][0] = np.nan
    lines += comparison_lines(studies, 3, 0.008)
    zones = {f"zones_{k}": ("increment", [0, n]) for n, k in enumerate(("in_shear", "in_tension", "yielded_before"), 2)}
    attrs = {"zones": 40, "deformable_blocks": 5, "plane": "stress"}
    ds = xr.Dataset({**zones, "block_x": ("block", np.zeros(9))}, attrs=attrs)
    lines += [*zones_lines(ds), *zones_lines((0 * ds).assign_attrs(attrs))]
    assert zones_lines(ds.drop_attrs()) == []
    check(LISTS / "sentences.txt", lines)
