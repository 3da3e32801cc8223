"""Steps of reading and writing archives by hand: older versions, digests, checks and provenance."""

import hashlib
import re
import zlib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from damagepred.archive import provenance, schema
from damagepred.archive.digest import NO_STUDY, read_signed_json, sign, signature, signed, signed_json, verified
from damagepred.archive.parts import _storable
from damagepred.archive.provenance import from_table, given_values, mixture, program, programs, why_bits_differ
from damagepred.archive.schema import (
    SCHEMA_VERSION,
    Column,
    check_attributes,
    check_values,
    flag_name,
    with_shared_movement,
)
from damagepred.archive.versions import brought_up_to_date, from_0, from_1
from damagepred.errors import DamagedError, InputError, NewerError

BOTH = ("sample", "increment")


def test_keys_of_version_7_count_from_1_today() -> None:
    scene = "[[soil_layer]]\nthickness = 1.0\n\n[suction]\nchange = 1.2\n"
    old = xr.Dataset(
        {"opening.0.width": ("sample", [1.0]), "joint.friction": ("sample", [0.7]), "x": ("variable", [1.0, 2.0])},
        {"variable": ["opening.0.x", "soil_layer.12.thickness"]},
        {"scene_given": "opening.0.width wall.length", "scene": scene},
    )
    now = brought_up_to_date(7, "old.nc", old)
    assert set(now.data_vars) == {"opening.1.width", "joint.friction", "x"}
    assert now["variable"].values.tolist() == ["opening.1.x", "soil_layer.13.thickness"]
    assert (now.attrs["scene_given"], now.attrs["schema_version"]) == ("opening.1.width wall.length", SCHEMA_VERSION)
    assert 'below_log = "inert"' in now.attrs["scene"]
    assert "change = 1.2" in now.attrs["scene"]
    plain = brought_up_to_date(7, "old.nc", xr.Dataset(coords={"variable": [1, 2]}, attrs={"scene": "[suction]\n"}))
    assert plain["variable"].values.tolist() == [1, 2]
    assert plain.attrs["scene"] == '[suction]\n\n[solver]\naccuracy = "standard"\n'
    stated = brought_up_to_date(7, "a", old.assign_attrs(scene=scene + 'below_log = "extend"\n'))
    assert 'below_log = "extend"' in stated.attrs["scene"]
    assert [from_0(from_1(key)) for key in ("a.0.b", "a.9", "joint.1x", "a")] == ["a.0.b", "a.9", "joint.1x", "a"]
    with pytest.raises(InputError, match="schema version 0; it is not one of damagepred"):
        brought_up_to_date(0, "a.nc")
    with pytest.raises(NewerError, match=f"reads up to {SCHEMA_VERSION}"):
        brought_up_to_date(SCHEMA_VERSION + 1, "a.nc")


def test_flags_and_movement_of_version_5() -> None:
    old = xr.Dataset(
        {
            "status": ("sample", np.zeros(2, np.int8), {"flag_values": np.arange(4, dtype=np.int8)}),
            "central_deflection": (BOTH, [[0, 2e-3], [0, 2e-3]]),
            "surface_movement": (BOTH, [[0, 1.0], [0, 2.0]]),
            "opening_width": (("sample", "opening"), np.zeros((2, 0))),
        }
    )
    now = brought_up_to_date(5, "a.nc", old)
    assert now["status"].attrs["valid_range"].tolist() == [0, 3]
    assert "opening" not in now.sizes
    assert (now["movement"].values.tolist(), now["movement"].attrs["comment"]) == ([0, 2e-3], "is central_deflection")
    assert now["increment"].values.tolist() == [0, 1]
    assert "movement" not in with_shared_movement(now.drop_vars(["movement", "central_deflection"]))
    assert "increment" not in with_shared_movement(xr.Dataset({"a": ("sample", [1.0])})).coords


def test_names_of_flags_and_kinds_of_archives() -> None:
    ds = xr.Dataset({"damage_category": ("sample", [0], {"flag_meanings": "fine not_fine"})})
    assert [schema.category_label(ds, k) for k in (-1, 0, 1, 2)] == ["not known", "0 fine", "1 not fine", "2 not known"]
    assert (flag_name(xr.Dataset(), 2, "status"), flag_name(xr.Dataset(), 4, "status")) == ("failed", "not known")
    assert flag_name(xr.Dataset(), 0, "unheard") == "not known"
    made = schema.dataset({"sample": [3, 4], "central_deflection": [0.0, 1e-3], "damage_category": [0, 1]}, {})
    assert set(made.coords) == {"sample", "central_deflection"}  # movements belong to the other variables
    time = xr.Dataset({"time": ("increment", [0.0])})
    assert [schema.is_dynamic(x) for x in (time, time.assign(stage=("increment", [0])), xr.Dataset())] == [
        True,
        False,
        False,
    ]
    for values in ([1, 2**31 - 1], [0, 2**31], [-(2**31)]):
        stored = _storable(np.array(values))
        assert stored.tolist() == values
        assert stored.dtype == (np.float64 if max(map(abs, values)) >= 2**31 else np.int32)
    assert _storable(np.zeros(0, dtype=np.int64)).dtype == np.int32
    assert _storable(np.zeros(2, dtype=np.int8)).dtype == np.int8


def test_a_digest_is_of_content_and_study(tmp_path: Path) -> None:
    """The checksum is of all that is read; the SHA-256 is compared where a file is verified."""
    file, content = tmp_path / "a.nc", b"CDF" + bytes(range(256)) * 1024
    file.write_bytes(content)
    sign(file, "0123456789abcdef")
    assert file.read_bytes() == signed(content, "0123456789abcdef")
    sha256 = hashlib.sha256(content + b"0123456789abcdef").hexdigest()
    crc32 = f"{zlib.crc32(content + b'0123456789abcdef'):08x}"
    end = f"\n# crc32 {crc32} sha256 {sha256} study 0123456789abcdef\n"
    assert file.read_bytes() == content + end.encode()
    assert signature(file) == signature(file, whole=True) == "0123456789abcdef"
    assert verified(file.read_bytes(), file) == (content, "0123456789abcdef")
    assert verified(content, file) == (content, None)
    whole = file.read_bytes()
    for changed in (b"X" + whole[1:], whole.replace(b"0123456789abcdef", b"0123456789abcdee")):
        file.write_bytes(changed)
        for check in (lambda: signature(file), lambda: verified(file.read_bytes(), file)):
            with pytest.raises(DamagedError, match="its digest differs"):
                check()
    sha = re.search(rb"sha256 (\w)", whole)
    file.write_bytes(whole[: sha.start(1)] + (b"1" if sha[1] == b"0" else b"0") + whole[sha.end(1) :])
    assert signature(file) == "0123456789abcdef"
    with pytest.raises(DamagedError, match="its digest differs"):
        signature(file, whole=True)
    record = tmp_path / "a.json"
    record.write_text(signed_json({"a": 1, "schema_version": 8}, NO_STUDY))
    assert read_signed_json(record) == {"a": 1, "schema_version": 8}
    assert read_signed_json(record, NO_STUDY)["a"] == 1
    with pytest.raises(DamagedError, match="belongs to another study"):
        read_signed_json(record, "0" * 16)
    record.write_text('{"a": 1, "schema_version": 3}')
    assert read_signed_json(record, "0" * 16)["a"] == 1  # from before there were digests
    record.write_text('{"a": 1, "schema_version": 4}')
    with pytest.raises(DamagedError, match="it has no digest"):
        read_signed_json(record, "0" * 16)


@pytest.mark.parametrize(
    ("name", "dims", "values", "attributes", "words"),
    [
        ("crack_width_max", ("increment", "sample"), np.zeros((2, 2)), {}, r"has the dimensions \(increment, sample\)"),
        ("crack_width_max", ("sample", "joint"), np.zeros((2, 2)), {}, r"has the dimensions \(sample, joint\)"),
        ("status", ("sample",), np.zeros(2), {}, "is of type float64"),
        ("run_time", ("sample",), np.array(["a"]), {}, "is of type <U1"),
        ("run_time", ("sample",), np.zeros(2), {"units": 3}, "has damaged attributes"),
        ("status", ("sample",), np.array([0, 4]), {}, "has the value 4"),
        ("status", ("sample",), np.array([-2, 0]), {}, "has the value -2"),
        ("sample", ("sample",), np.array([0, 2, 2]), {}, "does not count up"),
        ("sample", ("sample",), np.array([-1, 0]), {}, "does not count up"),
        ("run_time", ("sample",), np.array([0.0, -1e-9]), {}, "is negative"),
    ],
)
def test_damaged_values_are_named(name: str, dims: tuple, values: np.ndarray, attributes: dict, words: str) -> None:
    with pytest.raises(DamagedError, match=f"a.nc: .*{name} {words}"):
        check_values({name: Column(dims, values, attributes)}, "a.nc", ranges=True)


def test_sound_values_and_attributes_pass() -> None:
    good = {
        "status": (("sample",), np.array([0, 2, 3, -1], dtype=np.int8), {"units": "1"}),
        "sample": (("sample",), np.array([3, 4, 9]), {}),
        "run_time": (("sample",), np.array([0.0, np.nan]), {}),
        "weight": (("sample",), np.array([], dtype=float), {}),
        "another": (("x",), np.array([-1.0]), {}),
    }
    check_values({name: Column(*column) for name, column in good.items()}, "a.nc", ranges=True)
    nan, state = np.nan, np.array([0, 1, 2], dtype=np.int8)

    def widths(width: list, force: list) -> None:
        columns = {n: Column(BOTH, np.array(v), {}) for n, v in (("crack_width_max", width), ("base_reaction", force))}
        check_values(columns | {"status": Column(("sample",), state[: len(width)], {})}, "a.nc")

    widths([[0, 1], [0, nan], [nan, nan]], [[9, 9], [9, nan], [nan, 9]])
    for width, force in (([[0, nan]], [[9, 9]]), ([[nan, nan]], [[nan, nan]]), ([[0, 1, 2]], [[9, nan, 9]])):
        with pytest.raises(DamagedError, match="a solved sample has increments without crack width"):
            widths(width, force)
    with pytest.raises(DamagedError, match="differ in shape"):
        widths([[0, 1]], [[9]])
    attributes = {"title": "a", "seed": 0, "replicates": 1, "highest_category": 5, "crossed": 1, "span": 1e-9}
    check_attributes(attributes, "a.nc", ("title", "seed"))
    for wrong, words in (
        ({"title": 3}, "its attribute title is no text"),
        ({"replicates": 0}, "its attribute replicates is '0'"),
        ({"highest_category": 6}, "highest_category is '6'"),
        ({"crossed": 2}, "crossed is '2'"),
        ({"span": "6"}, "span is '6'"),
        ({"scene": "a ="}, "its attribute scene is no TOML"),
    ):
        with pytest.raises(DamagedError, match=words):
            check_attributes(attributes | wrong, "a.nc")
    with pytest.raises(DamagedError, match="it has no attribute seed"):
        check_attributes({"title": "a"}, "a.nc", ("title", "seed"))


def test_programs_machines_and_their_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    a, b = ({"damagepred_version": "1", "kernel_hash": hash_, "machine": "m"} for hash_ in ("x", "y"))
    ds = xr.Dataset({"status": ("sample", np.array([0, 1, 2, 0], dtype=np.int8))})
    assert programs(ds) == {"an older version that did not record itself": 3}
    ds["environment"] = ("sample", [0, 1, 1, 0], provenance.as_table([a, b]))
    assert programs(ds) == {program(a): 2, program(b): 1}
    assert program(a) == "version 1, commit unknown, kernel hash x"
    assert mixture(ds) == [f"samples were solved by 2 programs, which may differ: 2 by {program(a)}; 1 by {program(b)}"]
    assert mixture(ds.isel(sample=[0, 3])) == []
    assert why_bits_differ(a, b) == "It was solved with another kernel hash (x, here y)."
    other = {"damagepred_version": "1", "kernel_hash": "x"}
    assert why_bits_differ(a, other) == "It was solved with another machine (m, here unknown)."
    for wrong in ("{}", "[1]", "[", None):
        with pytest.raises(DamagedError, match="its table of environments is no list"):
            from_table({"environments": wrong}, "a")
    assert from_table({}) == []
    assert given_values({"b": "", "a": "mm"}) == {"scene_given": "a b", "scene_units": '{"a": "mm"}'}
    assert (given_values({"b": "", "a": ""}), given_values(None)) == ({"scene_given": "a b"}, {})
    text = "vendor_id : x\nmodel name\t: A fast one\nmodel name : another\n"
    monkeypatch.setattr(provenance.Path, "read_text", lambda *_, **__: text)
    assert provenance.machine.__wrapped__().startswith("A fast one, ")
    libraries = [
        SimpleNamespace(internal_api="openblas", version="3", architecture="Zen"),
        SimpleNamespace(internal_api="mkl", version=None),
    ]
    monkeypatch.setattr(provenance, "blas_libraries", lambda: libraries)
    assert provenance.blas.__wrapped__() == "mkl, openblas 3 Zen"
    monkeypatch.setattr(provenance, "blas_libraries", list)
    assert provenance.blas.__wrapped__() == "unknown"
