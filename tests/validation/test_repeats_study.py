"""The study of repeated settlements: two repeats of a small one."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from damagepred import solve

ROOT = Path(__file__).resolve().parents[2]


def test_repeats_return_to_the_same_settlement() -> None:
    """The settlement is there at the increments that the table takes, and the widest so far never falls."""
    spec = importlib.util.spec_from_file_location("repeats", ROOT / "studies" / "seasons" / "repeats.py")
    assert spec is not None
    assert spec.loader is not None
    study = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(study)
    ds = solve(study.facade("dishing", 1e-3, 2, 2))
    there = ds["central_deflection"].values[2::4]
    assert there == pytest.approx([1e-3, 1e-3])
    psi, width = study.at_each_repeat(ds, 2)
    assert len(psi) == len(width) == 2
    assert (np.diff(width) >= 0.0).all()
