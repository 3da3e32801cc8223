"""Compiled kernels are kept on the disk, where processes that run at the same time share them."""

import subprocess
import sys
from pathlib import Path

import pytest
from numba import types

from damagepred.kernels import jit
from damagepred.kernels.process_cache import ProcessCache


def doubled(x):
    return 2 * x


def test_two_that_compile_at_once_for_different_arguments_keep_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    caches = [ProcessCache(tmp_path), ProcessCache(tmp_path)]  # neither has the files of the other
    for cache, argument in zip(caches, (1, 1.0)):
        monkeypatch.setattr(jit, "CACHE_FOLDER", cache.folder)
        jit.kernel(doubled)(argument)
    for cache in caches:
        cache.close()
    assert not list((tmp_path / "processes").iterdir())
    assert len(list(tmp_path.rglob("*.nbc"))) == 1
    monkeypatch.setattr(jit, "CACHE_FOLDER", ProcessCache(tmp_path).folder)
    later = jit.kernel(doubled)
    for argument in (1, 1.0):
        assert type(later(argument)) is type(argument)
    assert sum(later.stats.cache_hits.values()) == 1  # the other was published too late: compiled again


def test_a_process_adds_kernels_to_those_of_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for argument in (1, 1.0):
        cache = ProcessCache(tmp_path)
        monkeypatch.setattr(jit, "CACHE_FOLDER", cache.folder)
        jit.kernel(doubled)(argument)
        cache.publish()
    monkeypatch.setattr(jit, "CACHE_FOLDER", ProcessCache(tmp_path).folder)
    later = jit.kernel(doubled)
    assert (later(1), later(1.0)) == (2, 2.0)
    assert sum(later.stats.cache_hits.values()) == 2


def test_phases_and_kernels_are_kept_in_the_folder_of_the_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "CACHE_FOLDER", tmp_path)
    assert jit.Phase(doubled, types.int64(types.int64)).__wrapper_address__()
    assert len(list(tmp_path.rglob("*.nbc"))) == 1


def test_folders_of_processes_that_have_ended_are_removed(tmp_path: Path) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    left = tmp_path / "processes" / f"{ended.pid}-left"
    left.mkdir(parents=True)
    cache, other = ProcessCache(tmp_path), ProcessCache(tmp_path)
    assert not left.exists()
    assert cache.folder.exists()
    other.close()
    cache.close()
