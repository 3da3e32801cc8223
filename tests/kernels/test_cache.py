"""Compiled kernels are kept on the disk, where processes that run at the same time share them."""

from pathlib import Path

import pytest

from damagepred.kernels import jit


def doubled(x):
    return 2 * x


def test_two_that_compile_at_once_for_different_arguments_keep_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "CACHE_FOLDER", tmp_path)
    for argument in (1, 1.0):
        one = jit.kernel(doubled)
        with monkeypatch.context() as patch:
            # neither has seen yet what the other keeps
            patch.setattr(one._cache._cache_file, "_load_index", dict)
            one(argument)
    assert len(list(tmp_path.rglob("*.nbc"))) == 2
    later = jit.kernel(doubled)
    for argument in (1, 1.0):
        assert type(later(argument)) is type(argument)
    assert sum(later.stats.cache_hits.values()) == 1  # the other's place in the index was lost: compiled anew
