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
from damagepred.archive.parts import joined, read_part, study_dims, write_part
from damagepred.archive.schema import (
    FLAG_FILL,
    SCHEMA_VERSION,
    VARIABLES,
    Column,
    Columns,
    category_attributes,
    dataset,
)
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


def test_newer_schema(tmp_path: Path):
    ds = dataset({"increment": [0]}, {})
    ds.attrs["schema_version"] = SCHEMA_VERSION + 1
    write_dataset(ds, tmp_path / "new.nc")
    with pytest.raises(InputError, match=f"schema version {SCHEMA_VERSION + 1}, .* up to {SCHEMA_VERSION}; update"):
        read_dataset(tmp_path / "new.nc")


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
def test_each_step_that_fails_leaves_the_old_file(old, monkeypatch, place, step, code, words) -> None:
    def fail(*_args: object, **_more: object) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(place, step, fail)
    with pytest.raises(StudyError, match=words):
        write_whole(old, lambda p: p.write_text("new"))
    monkeypatch.undo()
    assert untouched(old)


@pytest.mark.parametrize(("flags", "room", "words"), [(os.ST_RDONLY, 9, "read-only"), (0, 0, "disk is full")])
def test_a_disk_that_takes_nothing(flags: int, room: int, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "statvfs", lambda _: SimpleNamespace(f_flag=flags, f_blocks=9, f_bavail=room))
    with pytest.raises(StudyError, match=words):
        check_output(tmp_path / "wall.nc", ".nc")


def row(sample: int, increments: int = 5, openings: int = 2) -> Columns:
    random = np.random.default_rng(sample)
    values = {
        "sample": np.array([sample]),
        "status": np.array([sample % 2], dtype=np.int8),
        "run_time": random.random(1),
        "crack_width_max": random.standard_normal((1, increments)) * 1e-300,
        "cycles": random.integers(-1, 2**20, (1, increments)),
        "damage_category": random.integers(-1, 5, (1, increments)).astype(np.int8),
        "opening_width_change": random.standard_normal((1, increments, openings)),
        "increment": np.arange(increments),
    }
    values["crack_width_max"][0, -1] = np.nan
    found = {name: Column(study_dims(name), v, VARIABLES[name].attributes()) for name, v in values.items()}
    names = category_attributes(("keine", "größer als 1 mm"), "table; §1")
    return found | {"damage_category": found["damage_category"]._replace(attributes=names)}


def same_of_parts(first: Columns, second: Columns) -> None:
    assert first.keys() == second.keys()
    for name, column in first.items():
        np.testing.assert_array_equal(column.values, second[name].values, err_msg=name)
        assert column.dims == second[name].dims
        assert column.attributes.keys() == second[name].attributes.keys()
        for key, value in column.attributes.items():
            np.testing.assert_array_equal(value, second[name].attributes[key])


@pytest.mark.parametrize("openings", [0, 1, 2])
@pytest.mark.parametrize("samples", [1, 3])
def test_round_trip_parts(tmp_path: Path, samples: int, openings: int) -> None:
    written = joined([row(i, openings=openings) for i in range(samples)])
    write_part(tmp_path / "part.nc", written)
    back = read_part(tmp_path / "part.nc")
    same_of_parts({name: column for name, column in written.items() if column.values.size}, back)
    assert [p.name for p in tmp_path.iterdir()] == ["part.nc"]


@pytest.mark.parametrize("names", [None, ["status"], ["newton_iterations"], ["crack_width_worst", "cycles"], []])
@pytest.mark.parametrize("version", range(2, SCHEMA_VERSION + 1))
def test_some_variables_of_a_part_of_each_version(tmp_path, monkeypatch, version, names) -> None:
    """By their names of today, whatever they were called then; no others."""
    from damagepred.archive import parts

    written = row(1)
    written["newton_iterations"] = written["cycles"]
    written["crack_width_worst"] = written["crack_width_max"]
    written["joint_law_violation"] = written["crack_width_max"]  # of the quasi-static solver alone
    values, iterations = written["crack_width_worst"].values, written["newton_iterations"].values
    if version < 7:
        written["worst_crack_width"] = written.pop("crack_width_worst")
    if version < 5:
        del written["newton_iterations"]
    monkeypatch.setattr(parts, "SCHEMA_VERSION", version)
    write_part(tmp_path / "part.nc", written)
    monkeypatch.undo()
    found = read_part(tmp_path / "part.nc", names)
    today = {*row(1), "newton_iterations", "crack_width_worst", "joint_law_violation"}
    assert found.keys() - {"movement"} == ({"sample", *names} if names is not None else today)
    if "crack_width_worst" in found:
        np.testing.assert_array_equal(found["crack_width_worst"].values, values)
    if "newton_iterations" in found:
        np.testing.assert_array_equal(found["newton_iterations"].values, iterations)


@pytest.mark.parametrize("kept", [0.01, 0.1, 0.5, 0.9])
def test_damaged(tmp_path: Path, kept: float) -> None:
    file = tmp_path / "part.nc"
    write_part(file, row(1))
    content = file.read_bytes()
    file.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(InputError, match=r"part\.nc: is damaged"):
        read_part(file)
    file.write_bytes(b"")
    with pytest.raises(InputError, match="is not a readable netCDF file"):
        read_part(file)


def test_newer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from damagepred.archive import parts

    monkeypatch.setattr(parts, "SCHEMA_VERSION", SCHEMA_VERSION + 1)
    write_part(tmp_path / "part.nc", row(1))
    with pytest.raises(InputError, match=f"schema version {SCHEMA_VERSION + 1}, .* up to {SCHEMA_VERSION}; update it"):
        read_part(tmp_path / "part.nc")
