"""Hash of the sources that a result depends on."""

from pathlib import Path

import pytest

from damagepred.archive import provenance
from damagepred.runtime import version


def test_a_constant_of_the_solvers_changes_the_recorded_hash_and_compiles_nothing_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("kernels", "solvers"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "newton.py").write_text("MINIMUM_STEP = 0.1\n", encoding="utf-8")
    monkeypatch.setattr(version, "PACKAGE", tmp_path)
    provenance.environment.cache_clear()
    recorded, compiled = provenance.environment()["kernel_hash"], version.source_hash("kernels")
    (tmp_path / "solvers" / "newton.py").write_text("MINIMUM_STEP = 0.2\n", encoding="utf-8")
    provenance.environment.cache_clear()
    assert provenance.environment()["kernel_hash"] != recorded
    assert version.source_hash("kernels") == compiled
    provenance.environment.cache_clear()
