"""Files are written atomically, and read back unchanged."""

import errno
import os
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from damagepred.archive.files import check_output, read_dataset, write_dataset, write_whole
from damagepred.archive.schema import FLAG_FILL, SCHEMA_VERSION, VARIABLES, dataset
from damagepred.errors import InputError, StudyError

STEPS, BLOCKS, CONTACTS, OPENINGS, VERTICES = 4, 700, 2100, 2, 2800
SIZES = (
    {"increment": STEPS, "block": BLOCKS, "contact": CONTACTS, "opening": OPENINGS, "vertex": VERTICES, "sample": 1}
    | {"section": 24, "support": 2, "jack": 3, "zone": 600, "gridpoint": 450, "zone_corner": 3, "group_count": 4}
    | {"wall": 3, "corner": 2}
)
COUNTS = (
    "increment newton_iterations cycles crack_count block_course vertex_block contact_interface contact_joint sample "
    "apex_limited snap_back_limited zone_mesh zone_gridpoint zone_block gridpoint_block zones_in_shear "
    "zones_in_tension zones_yielded_before group_count"
)


def wall(seed: int = 0) -> xr.Dataset:
    """Every registered variable of a wall's file, with random values, some of them unknown."""
    random = np.random.default_rng(seed)
    values: dict[str, np.ndarray] = {}
    for name, variable in VARIABLES.items():
        if "sample" in variable.dims:
            continue
        shape = tuple(SIZES[d] for d in variable.dims)
        if variable.flags:
            values[name] = random.integers(-1, len(variable.flags), shape).astype(np.int8)
        elif name in COUNTS.split():
            values[name] = random.integers(-1, 10**6, shape)
        else:
            digits, powers = (np.float32, 30) if variable.on_disk else (np.float64, 300)
            values[name] = random.standard_normal(shape) * 10.0 ** random.integers(-powers, powers, shape)
            values[name] = values[name].astype(digits).astype(np.float64)
            values[name].ravel()[0] = np.nan if "central" not in name and "ratio" not in name else 0.0
    values["increment"], values["group_count"] = np.arange(STEPS), np.arange(4) + 2
    return dataset(values, {"title": "Wände über Öffnungen", "scene": "a = 1\nb = 2\n", "complete": True, "span": 6.0})


def same(first: xr.Dataset, second: xr.Dataset) -> None:
    assert set(first.variables) == set(second.variables)
    assert set(first.coords) == set(second.coords)
    for name in first.variables:
        a, b = first[name], second[name]
        assert a.dims == b.dims, name
        np.testing.assert_array_equal(a.values, b.values, err_msg=str(name))  # to the last bit, NaN included
        if a.dtype.kind == "f" or a.dtype == np.int8:
            assert a.dtype == b.dtype, name
        assert a.attrs.keys() == b.attrs.keys(), name
        for key, value in a.attrs.items():
            np.testing.assert_array_equal(value, b.attrs[key], err_msg=f"{name}.{key}")
            if isinstance(value, np.ndarray):
                assert value.dtype == b.attrs[key].dtype
    assert first.attrs == second.attrs


def test_round_trip(tmp_path: Path):
    ds = wall()
    write_dataset(ds, tmp_path / "wall.nc")
    back = read_dataset(tmp_path / "wall.nc")
    same(ds, back)
    write_dataset(back, tmp_path / "again.nc")
    same(ds, read_dataset(tmp_path / "again.nc"))


def test_anyone_s_xarray_can_open_it(tmp_path: Path):
    ds = wall()
    write_dataset(ds, tmp_path / "wall.nc")
    with xr.open_dataset(tmp_path / "wall.nc") as opened:
        np.testing.assert_array_equal(opened["contact_opening"].values, ds["contact_opening"].values)
        state = opened["contact_state"]
        assert state.dtype == np.int8
        assert (state.values == FLAG_FILL).any()
        np.testing.assert_array_equal(state.values, ds["contact_state"].values)


# -- what is not ours ------------------------------------------------------------------------------------------------


def test_newer_schema(tmp_path: Path):
    ds = dataset({"increment": [0]}, {})
    ds.attrs["schema_version"] = SCHEMA_VERSION + 1
    write_dataset(ds, tmp_path / "new.nc")
    with pytest.raises(InputError, match=f"schema version {SCHEMA_VERSION + 1}, .* up to {SCHEMA_VERSION}; update"):
        read_dataset(tmp_path / "new.nc")


# -- whole or not at all ---------------------------------------------------------------------------------------------


@pytest.fixture
def old(tmp_path: Path) -> Path:
    file = tmp_path / "wall.nc"
    file.write_text("precious")
    return file


def untouched(file: Path) -> bool:
    return file.read_text() == "precious" and [p.name for p in file.parent.iterdir()] == [file.name]


def broken(error: BaseException):
    def write(temporary: Path) -> None:
        temporary.write_text("half")
        raise error

    return write


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (errno.ENOSPC, "the disk is full; free some space"),
        (errno.EDQUOT, "quota"),
        (errno.EFBIG, "file size limit"),
        (errno.EACCES, "no permission to write there; choose another place"),
        (errno.EPERM, "no permission"),
        (errno.EROFS, "read-only; choose another place"),
        (errno.ENOENT, "folder does not exist"),
        (errno.ENOTDIR, "is a file, not a folder"),
        (errno.EIO, os.strerror(errno.EIO)),
    ],
)
def test_failing_writes_leave_the_old_file_and_nothing_else(old: Path, code: int, words: str):
    with pytest.raises(StudyError, match=words) as caught:
        write_whole(old, broken(OSError(code, os.strerror(code))))
    assert str(old) in str(caught.value)
    assert untouched(old)


def test_the_netcdf_library_s_word_for_a_full_disk(old: Path):
    with pytest.raises(StudyError, match=r"NetCDF: HDF error\. Is the disk full\?"):
        write_whole(old, broken(RuntimeError("NetCDF: HDF error")))
    assert untouched(old)


@pytest.mark.parametrize(
    ("place", "step", "code", "words"),
    [
        (os, "fsync", errno.ENOSPC, "the disk is full"),
        (Path, "replace", errno.ENOSPC, "the disk is full"),
        (Path, "chmod", errno.ENOSPC, "the disk is full"),
        (tempfile, "mkstemp", errno.EACCES, "no permission to write there; choose another place"),
    ],
)
def test_each_step_that_fails_leaves_the_old_file(
    old: Path, monkeypatch: pytest.MonkeyPatch, place: object, step: str, code: int, words: str
):
    def fail(*_args: object, **_more: object) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(place, step, fail)
    with pytest.raises(StudyError, match=words):
        write_whole(old, lambda p: p.write_text("new"))
    monkeypatch.undo()
    assert untouched(old)


# -- checking beforehand -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("flags", "room", "words"), [(os.ST_RDONLY, 9, "read-only"), (0, 0, "disk is full")])
def test_a_disk_that_takes_nothing(flags: int, room: int, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "statvfs", lambda _: SimpleNamespace(f_flag=flags, f_blocks=9, f_bavail=room))
    with pytest.raises(StudyError, match=words):
        check_output(tmp_path / "wall.nc", ".nc")
