"""Damaged study folders, as studies/fuzz does it: a few of them always."""

import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).resolve().parents[2] / "studies" / "fuzz"


def test_damaged_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.syspath_prepend(str(FUZZ))
    import folders

    monkeypatch.setattr(sys, "argv", ["damagepred"])
    assert folders.main(6, 1, tmp_path) == 0, capsys.readouterr().out
    assert len((tmp_path / "folders.csv").read_text().splitlines()) == 7
