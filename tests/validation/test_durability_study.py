"""Disturbed studies, as in studies/durability: two of its six disturbances."""

from pathlib import Path

import pytest

from tests.validation.test_validation_cases import ROOT, module


@pytest.mark.slow
def test_a_kill_and_a_full_disk(tmp_path: Path) -> None:
    """The others are in tests/campaign/test_workers.py and test_cluster.py, and in tests/cli/test_commands.py."""
    durability = module("durability_run", ROOT / "studies" / "durability" / "run.py")
    found = durability.mistreat(["kill", "disk"], walls=4, kills=1, place=tmp_path)
    assert set(found) == {"kill", "disk"}
    assert "parts kept" in found["disk"]
