"""The study that reads exported curves in pelicun and OpenQuake."""

import importlib.util
from pathlib import Path

import numpy as np

from damagepred.exports import pelicun_frame

STUDY = Path(__file__).resolve().parents[2] / "studies" / "exports"


def test_the_study_compares_its_curves() -> None:
    spec = importlib.util.spec_from_file_location("exports_run", STUDY / "run.py")
    assert spec is not None
    assert spec.loader is not None
    run = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(run)
    for measure, (_, unit, _, medians, dispersion) in run.CASES.items():
        row = pelicun_frame(run.known_curves(measure)).iloc[0]
        assert row["Demand-Unit"] == unit
        assert [row[f"LS{i}-Theta_0"] for i in range(1, 5)] == list(medians)
        assert np.allclose([row[f"LS{i}-Theta_1"] for i in range(1, 5)], dispersion, rtol=0)
