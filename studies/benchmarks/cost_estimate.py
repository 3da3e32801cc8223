"""Estimated time of a study, by `check` and by the first line of its run, beside the measured time.

    python studies/benchmarks/cost_estimate.py

prints for four studies with the variables of ``data/bryant_study.toml`` the time of one wall by ``damagepred check``,
the time left after the first wall, and the measured times. One core, some minutes.
"""

from __future__ import annotations

import tempfile
import tomllib
from pathlib import Path
from typing import Any

import pandas as pd
import tomli_w

from damagepred import Study, open_study
from damagepred.campaign.cost_estimate import estimate_cost

DATA = Path(__file__).resolve().parents[2] / "data"
SAMPLES = 6
SOLID = {"wall": {"length": 3.6, "height": 1.2}}
STUDIES: dict[str, tuple[str, dict[str, dict[str, Any]]]] = {
    "rigid": ("bryant_dishing.toml", {"solver": {"blocks": "rigid"}}),
    "elastic": ("bryant_dishing.toml", SOLID | {"solver": {"blocks": "elastic"}}),
    "zones": ("bryant_dishing.toml", {"wall": {"length": 2.4, "height": 0.6}, "solver": {"blocks": "deformable"}}),
    "openings": ("bryant_window_dishing.toml", {}),
}


def study(scene: str, changes: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Tables of the study of a scene with changes."""
    tables = tomllib.loads((DATA / "bryant_study.toml").read_text(encoding="utf-8"))
    tables["scene"] = tomllib.loads((DATA / scene).read_text(encoding="utf-8"))
    for table, values in changes.items():
        tables["scene"].setdefault(table, {}).update(values)
    tables["study"]["samples"] = SAMPLES
    tables["variables"].pop("movement.central_deflection")
    return tables


def main() -> None:
    """Print the table."""
    rows = []
    for name, (scene, changes) in STUDIES.items():
        with tempfile.TemporaryDirectory() as folder:
            file, seen = Path(folder) / "study.toml", []
            file.write_text(tomli_w.dumps(study(scene, changes)), encoding="utf-8")
            check = estimate_cost(file).wall_seconds
            Study.from_toml(file).run(Path(folder) / "study.dp", on_progress=seen.append)
            times = open_study(Path(folder) / "study.dp")["run_time"].values
        rows.append((name, check, times.mean(), check / times.mean(), seen[1].seconds_left / times[1:].sum()))
    columns = ["study", "one wall by check (s)", "mean wall (s)", "check / mean", "first time left / measured"]
    print(pd.DataFrame(rows, columns=columns).to_string(index=False, float_format="{:.2f}".format))


if __name__ == "__main__":
    main()
