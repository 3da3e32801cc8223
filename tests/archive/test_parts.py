"""Parts are written and read to the last bit, by this program and by others."""

from pathlib import Path

import numpy as np
import pytest

from damagepred.archive.parts import Column, Columns, joined, read_part, study_dims, write_part
from damagepred.archive.schema import SCHEMA_VERSION, VARIABLES, category_attributes
from damagepred.errors import InputError


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


def same(first: Columns, second: Columns) -> None:
    assert first.keys() == second.keys()
    for name, column in first.items():
        np.testing.assert_array_equal(column.values, second[name].values, err_msg=name)
        assert column.dims == second[name].dims
        assert column.attributes.keys() == second[name].attributes.keys()
        for key, value in column.attributes.items():
            np.testing.assert_array_equal(value, second[name].attributes[key])


@pytest.mark.parametrize("openings", [0, 1, 2])
@pytest.mark.parametrize("samples", [1, 3])
def test_round_trip(tmp_path: Path, samples: int, openings: int) -> None:
    written = joined([row(i, openings=openings) for i in range(samples)])
    write_part(tmp_path / "part.nc", written)
    back = read_part(tmp_path / "part.nc")
    same({name: column for name, column in written.items() if column.values.size}, back)
    assert [p.name for p in tmp_path.iterdir()] == ["part.nc"]


@pytest.mark.parametrize("names", [None, ["status"], ["newton_iterations"], ["crack_width_worst", "cycles"], []])
@pytest.mark.parametrize("version", range(2, SCHEMA_VERSION + 1))
def test_some_variables_of_a_part_of_each_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, version: int, names: list[str] | None
) -> None:
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
