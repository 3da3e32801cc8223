"""The command that lists and removes compiled code."""

import os
from pathlib import Path

import pytest

from tests.cli.conftest import Run


def test_folders_are_listed_and_those_in_use_are_kept(
    command: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "none"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    idle, used = tmp_path / "kernels-1", tmp_path / "kernels-2"
    for folder, process in ((idle, "99999999-ended"), (used, f"{os.getpid()}-here")):
        (folder / "joint_1").mkdir(parents=True)
        (folder / "joint_1" / "law.1.nbc").write_bytes(bytes(3_000_000))
        (folder / "processes" / process).mkdir(parents=True)
    os.link(idle / "joint_1" / "law.1.nbc", idle / "processes" / "99999999-ended" / "law.1.nbc")
    listed = command("cache").out
    assert f"{idle}: 3 MB, not in use" in listed.replace("\n", "")
    assert f"{used}: 3 MB, in use" in listed.replace("\n", "")
    assert idle.exists()
    assert f"{idle}: 3 MB, removed" in command("cache", "--clear").out.replace("\n", "")
    assert not idle.exists()
    assert used.exists()
