"""Two hundred mutated files: refused in a sentence, failed by name, or with a finite result; and the run resumes."""

from pathlib import Path

import pytest

from studies.fuzz.run import GOOD, Options, defects, read_log, run, summary, try_file

COUNT, SEED = 200, 2


@pytest.mark.thorough
@pytest.mark.timeout(300)
def test_mutated_files(tmp_path: Path) -> None:
    options, said = Options(solved_share=0.0), []
    half = run(COUNT // 2, SEED, tmp_path, options, said.append)
    # as if it had been killed in the middle of a line
    log = tmp_path / "files.csv"
    log.write_bytes(log.read_bytes()[:-7])
    found = run(COUNT, SEED, tmp_path, options, said.append)
    assert defects(found) == []
    assert [t[:4] for t in found[: len(half)]] == [t[:4] for t in half]
    assert [t.number for t in read_log(log)] == list(range(COUNT))
    outcomes = {t.outcome for t in found}
    assert outcomes == {"refused", "accepted"} <= set(GOOD)
    assert sum(t.outcome == "accepted" for t in found) > COUNT // 20
    assert "scene,refused," in summary(found)
    assert any("200 of 200 files" in line for line in said)


@pytest.mark.timeout(300)
def test_a_file_that_is_solved(tmp_path: Path) -> None:
    read = (try_file(n, SEED, Options(solved_share=0.0), tmp_path) for n in range(COUNT))
    accepted = next(t.number for t in read if t.outcome == "accepted" and t.kind == "scene: solid")
    assert try_file(accepted, SEED, Options(solved_share=1.0), tmp_path).outcome in ("solved", "failed by name")
