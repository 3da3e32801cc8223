"""Compiled kernels are kept on the disk, where processes that run at the same time share them."""

import os
import re
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from numba import types

import damagepred
from damagepred.kernels import jit
from damagepred.kernels.cache_folder import cache_folder
from damagepred.kernels.process_cache import ProcessCache
from damagepred.runtime.version import source_hash


def doubled(x):
    return 2 * x


def test_two_that_compile_at_once_for_different_arguments_keep_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
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


def test_phases_and_kernels_are_kept_in_the_folder_of_the_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(jit, "CACHE_FOLDER", tmp_path)
    assert jit.Phase(doubled, types.int64(types.int64)).__wrapper_address__()
    assert len(list(tmp_path.rglob("*.nbc"))) == 1


def test_the_folder_has_the_hash_of_every_room_that_its_files_name() -> None:
    wall = damagepred.Scene(movement=damagepred.Movement(central_deflection=1e-3, increments=1))
    damagepred.solve(wall, store_zones=False)
    assert jit.CACHE_FOLDER.parents[1].name == f"kernels-{source_hash(*jit.ROOMS)}"
    named = b"".join(index.read_bytes() for index in jit.CACHE_FOLDER.rglob("*.nbi"))
    rooms = {room.decode() for room in re.findall(rb"damagepred\.([a-z_]+)\.", named)}
    assert {"assembly", "kernels"} <= rooms <= set(jit.ROOMS)


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


posix = pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners and modes are those of POSIX")


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """A user's cache and a temporary folder; the second is writable by all and sticky, as ``/tmp`` is."""
    user, temporary = tmp_path / "user", tmp_path / "temporary"
    user.mkdir(mode=0o700)
    temporary.mkdir()
    temporary.chmod(0o1777)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(user))
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    return user, temporary


def test_the_cache_of_the_user_comes_first(places: tuple[Path, Path]) -> None:
    folder = cache_folder("kernels-1")
    assert folder == places[0] / "damagepred" / "kernels-1"
    for level in (folder, folder.parent):
        assert stat.S_IMODE(level.stat().st_mode) == 0o700
    assert cache_folder("kernels-1") == folder  # found again


def test_a_folder_that_the_user_names_comes_before(places, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "named" / "deep"))
    assert cache_folder("kernels-1") == tmp_path / "named" / "deep" / "kernels-1"


@posix
def test_the_temporary_folder_has_one_for_each_user(places: tuple[Path, Path]) -> None:
    places[0].chmod(0o777)
    assert cache_folder("kernels-1") == places[1] / f"damagepred-{os.getuid()}" / "kernels-1"


@posix
@pytest.mark.parametrize("level", ["damagepred-4242", "damagepred-4242/kernels-1"])
def test_what_another_user_made_is_not_read(level: str, places: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch):
    (places[1] / level).mkdir(mode=0o700, parents=True)
    monkeypatch.setattr(os, "getuid", lambda: 4242)  # who runs this test is the other user
    assert cache_folder("kernels-1") is None


@posix
@pytest.mark.parametrize("mode", [0o770, 0o707, 0o777])
@pytest.mark.parametrize("level", ["damagepred", "damagepred/kernels-1"])
def test_what_others_may_write_to_is_not_read(level: str, mode: int, places: tuple[Path, Path]) -> None:
    folder = places[0] / level
    folder.mkdir(parents=True, mode=0o700)
    folder.chmod(mode)
    assert cache_folder("kernels-1") == places[1] / f"damagepred-{os.getuid()}" / "kernels-1"


@posix
def test_the_user_s_own_group_may_write_above_and_no_other(places: tuple[Path, Path], monkeypatch) -> None:
    places[0].chmod(0o770)
    monkeypatch.setattr(os, "getgid", lambda: places[0].stat().st_gid)
    assert cache_folder("kernels-1") == places[0] / "damagepred" / "kernels-1"
    monkeypatch.setattr(os, "getgid", lambda: places[0].stat().st_gid + 1)
    assert cache_folder("kernels-1") == places[1] / f"damagepred-{os.getuid()}" / "kernels-1"


@posix
def test_a_link_is_not_followed(places: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "theirs").mkdir(mode=0o700)
    for base, own in zip(places, ("damagepred", f"damagepred-{os.getuid()}"), strict=True):
        (base / own).symlink_to(tmp_path / "theirs")
    assert cache_folder("kernels-1") is None


@posix
@pytest.mark.skipif(os.geteuid() == 0 if hasattr(os, "geteuid") else False, reason="root writes everywhere")
def test_nowhere_to_write(places: tuple[Path, Path]) -> None:
    for place in places:
        place.chmod(0o500)
    assert cache_folder("kernels-1") is None
