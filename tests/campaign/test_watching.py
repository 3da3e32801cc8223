"""`status --watch` ends once no wall is left, whether or not walls failed."""

from types import SimpleNamespace

import pytest

from damagepred.campaign import status


@pytest.mark.parametrize("failed", [0, 2])
def test_watching_goes_on_until_no_wall_remains(monkeypatch: pytest.MonkeyPatch, failed: int) -> None:
    looks = [SimpleNamespace(remaining=left, failed=failed) for left in (4, 1, 0)]
    waits: list[float] = []
    queue = iter(looks)
    monkeypatch.setattr(status, "study_status", lambda _: next(queue))
    monkeypatch.setattr(status.time, "sleep", waits.append)
    assert list(status.watching("house.dp", 2.5)) == looks
    assert waits == [2.5, 2.5]
