"""Numbers with units and tables of numbers are read strictly; what is no finite number is refused by name."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from damagepred.errors import InputError
from damagepred.scene import BaseMotion
from damagepred.scene.input_tables import read_record
from damagepred.scene.number_table import Column, read_number_table
from damagepred.scene.quantity import to_si


def written(folder: Path, text: str | bytes) -> Path:
    file = folder / "table.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


@pytest.mark.parametrize(
    "text",
    [
        "x (m),level (mm)\n0,1.5\n2,-3\n",
        "x (m);level (mm)\n0;1,5\n2;-3\n",
        "x (m)\tlevel (mm)\n0\t1,5\n2\t-3\n",
        "x (m)\tlevel [mm]\r\n0\t1.5\r\n2\t-3\r\n",
        "x (m) level (mm)\n0 1.5\n2 -3\n",
        "# survey of 3 May, east\n\nx (m), level (mm)\n0, 1.5\n# a remark\n2, -3\n",
        "x (m),level (mm),,\n0,1.5,,\n2,-3,,\n,,,\n",
        '"x (m)","level (mm)"\n"0","1.5"\n2,-3e0\n',
        b"\xef\xbb\xbfx (m),level (mm)\n0,1.5\n2,-3\n",
        "x (m)\tlevel (mm)\n0\t1.5\n2\t-3\n".encode("utf-16"),
        "x,level_mm\n0,1.5\n2,-3\n",
        "x (cm),level (m)\n0,0.0015\n200,-0.003\n",
    ],
)
def test_forms_of_the_same_table(tmp_path: Path, text: str | bytes) -> None:
    table = read_number_table(written(tmp_path, text), columns=2)
    np.testing.assert_allclose(table.numbers(0, "m"), [0.0, 2.0], rtol=1e-15)
    np.testing.assert_allclose(table.numbers(1, "m"), [1.5e-3, -3e-3], rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("# remark\n\n", "is empty"),
        ("x,y\n", "no rows of numbers"),
        ("1,2\n3,4\n", "must name the columns"),
        ("x,y\n1,0,31\n2,0,42\n", "line 2: has 3 cells, the header 2.*commas: '1,0,31'.*decimal comma"),
        ("x\n0,31\n", "line 2: has 2 cells, the header 1.*decimal comma"),
        ("x,y\n1,2\n# remark\n3\n", "line 4: has 1 cells, the header 2"),
        ("x,y\n1;2\n", "line 2: has 1 cells"),
        ('x,y\n1,"0,5"\n', "line 2, y = '0,5': has a decimal comma"),
        ("x;y\n1;1.234,5\n", r"line 2, y = '1\.234,5': has a thousands separator"),
        ("x;y\n0,5;1 234\n", "line 2, y = '1 234': has a thousands separator"),
        ('x,y\n1,"1,234.5"\n', "thousands separator"),
        ("x,y\n1,1'234\n", "thousands separator"),
        ("x;y\n0,5;1\n1.5;2\n", r"decimal points \(line 3\) and commas \(line 2\)"),
        ("x;y\n0,5;1.234\n", "decimal points"),
        ("x,x\n1,2\n", "named twice: x"),
        ("x,y\n1,\n", "line 2, y = '': is empty"),
        ("x,y\n1,nan\n", "line 2, y = 'nan': is no finite number"),
        ("x,y\n1,-inf\n", "no finite number"),
        ("x,y\n1,1e999\n", "line 2, y"),
        ("x,y\n1,high\n", "line 2, y = 'high'"),
        ("x,y\n1,0.5 mm\n", "a unit goes to the column's name"),
        ("x,y\n1,1_000\n", "line 2, y = '1_000'"),
        ('x,y\n1,"2\n', "line 2: is no row"),
        ("x (kPa),y\n1,2\n", r"column 'x \(kPa\)': has the wrong kind of unit"),
        ("x (metre-ish),y\n1,2\n", "column 'x"),
        ("x,y\n1,2\n".encode("utf-16-le"), "UTF-16"),
        ("x,höhe\n1,2\n".encode("latin-1"), "Latin-1"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1", "save it as xlsx"),
        (b"PK\x03\x04 no workbook", "no xlsx workbook"),
    ],
)
def test_what_is_no_table_of_numbers(tmp_path: Path, text: str | bytes, said: str) -> None:
    def numbers() -> None:
        table = read_number_table(written(tmp_path, text))
        for k in range(len(table.names)):
            table.numbers(k, "m")

    with pytest.raises(InputError, match=said) as refused:
        numbers()
    assert "table.csv" in str(refused.value)


def test_a_header_may_be_left_out_where_columns_go_by_their_place(tmp_path: Path) -> None:
    table = read_number_table(written(tmp_path, "0;1,5\n2;3\n"), columns=2, header=False)
    assert table.numbers(1, "m").tolist() == [1.5, 3.0]
    for text in ("nan,1\n2,3\n", ",1\n2,3\n"):
        with pytest.raises(InputError, match="line 1"):
            read_number_table(written(tmp_path, text), columns=2, header=False).numbers(0, "m")
    with pytest.raises(InputError, match="has 3 columns; 2 are expected"):
        read_number_table(written(tmp_path, "0,1,5\n2,3,5\n"), columns=2, header=False)


def test_workbooks(tmp_path: Path) -> None:
    pytest.importorskip("openpyxl")
    frame = pd.DataFrame({"x (m)": [0, 1.5], "level (mm)": [1, -3.25]})
    frame.to_excel(tmp_path / "one.xlsx", index=False)
    table = read_number_table(tmp_path / "one.xlsx", columns=2)
    assert table.numbers(0, "m").tolist() == [0.0, 1.5]
    np.testing.assert_allclose(table.numbers(1, "m"), [1e-3, -3.25e-3])
    frame.assign(**{"level (mm)": [1, "0,5"]}).to_excel(tmp_path / "text.xlsx", index=False)
    with pytest.raises(InputError, match="line 3, level = '0,5': has a decimal comma"):
        read_number_table(tmp_path / "text.xlsx").numbers(1, "m")
    with pd.ExcelWriter(tmp_path / "two.xlsx") as book:
        for name in ("east", "west"):
            frame.to_excel(book, sheet_name=name, index=False)
    with pytest.raises(InputError, match=r"has 2 \(east, west\)"):
        read_number_table(tmp_path / "two.xlsx")


def test_a_workbook_without_openpyxl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*args: object, **options: object) -> None:
        raise ImportError("openpyxl")

    monkeypatch.setattr(pd, "read_excel", missing)
    with pytest.raises(InputError, match=r"damagepred\[excel\]"):
        read_number_table(written(tmp_path, b"PK\x03\x04"))


def test_columns_are_known_by_name_synonym_or_name_with_unit(tmp_path: Path) -> None:
    expected = {"movement": Column("m", others=("rise",)), "time": Column("year"), "share": Column("1")}
    table = read_number_table(written(tmp_path, "Movement_mm,rise (cm),TIME (years),share_mm,movement_kN\n1,2,3,4,5\n"))
    assert table.keys(expected) == ["movement", "movement", "time", None, None]


HEAD = """PEER NGA STRONG MOTION DATABASE RECORD
Somewhere, 1/17/1994, Hill, 90
{kind} TIME SERIES IN UNITS OF {unit}
"""
VALUES = np.array([0.0, 0.012345, -0.0543210, 0.1, -0.2345678, 0.05, 0.0])


def rows(values: np.ndarray) -> str:
    """Five columns of 15 characters, as FORTRAN writes them."""
    return "\n".join("".join(f"{v:15.7E}" for v in values[k : k + 5]) for k in range(0, len(values), 5)) + "\n"


def record(folder: Path, text: str, name: str = "RSN1.AT2") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


G = HEAD.format(kind="ACCELERATION", unit="G")
NPTS = "NPTS=      7, DT=   .0050 SEC,\n"


@pytest.mark.parametrize("steps", [NPTS, "NPTS= 7, DT= 0.005\n", "    7   0.0050   NPTS, DT\n"])
@pytest.mark.parametrize("name", ["RSN1.AT2", "shaken.txt"])
def test_an_acceleration_in_g(tmp_path: Path, steps: str, name: str) -> None:
    time, values = BaseMotion(file=str(record(tmp_path, G + steps + rows(VALUES), name))).record()
    np.testing.assert_allclose(time, 0.005 * np.arange(7), rtol=1e-12)
    np.testing.assert_allclose(values, 9.80665 * VALUES, rtol=1e-7)


def test_columns_may_touch_and_other_quantities_have_their_unit(tmp_path: Path) -> None:
    touching = "  -.1234567E-02-.2000000E-02 -.1000000E-02\n  .3E-2\n"
    file = record(tmp_path, HEAD.format(kind="VELOCITY", unit="CM/SEC") + "NPTS= 4, DT= .01 SEC\n" + touching, "a.VT2")
    time, values = BaseMotion(file=str(file), quantity="velocity").record()
    np.testing.assert_allclose(values, 1e-2 * np.array([-1.234567e-3, -2e-3, -1e-3, 3e-3]), rtol=1e-12)
    assert time[-1] == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("text", "keys", "said"),
    [
        (G + rows(VALUES), {}, "has no line 'NPTS= 4000, DT="),
        (G + NPTS.replace("7", "8") + rows(VALUES), {}, "line 4: NPTS is 8, but the file has 7 values"),
        (G + NPTS.replace(".0050", "0"), {}, "line 4: NPTS must be 2 or more and DT greater than 0"),
        (NPTS + rows(VALUES), {}, "has no line 'ACCELERATION TIME SERIES IN UNITS OF G'"),
        (G + NPTS + "0.1 0.2 x 0.3\n", {}, "line 5, character 9: is no number"),
        (G + NPTS + "0.1 nan\n", {}, "line 5, character 5"),
        (G + NPTS + rows(VALUES), {"quantity": "velocity"}, "UNITS OF G: has the wrong kind of unit.*quantity = 'vel"),
        (G + NPTS + rows(VALUES), {"scale": 9.81}, "'G'; scale = 9.81 converts it again"),
        (HEAD.format(kind="A", unit="FURLONG") + NPTS, {}, "UNITS OF FURLONG"),
    ],
)
def test_what_is_no_record(tmp_path: Path, text: str, keys: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        BaseMotion(file=str(record(tmp_path, text)), **keys).record()


@pytest.mark.parametrize(
    ("head", "order"),
    [("t (s),a (m/s2)", 1), ("a,t", -1), ("Acc. (g),Time (s)", -1), ("time,ground", 1), ("ground,time", -1)],
)
def test_columns_of_a_table_are_found_by_their_names(tmp_path: Path, head: str, order: int) -> None:
    rows = [(0.0, 0.5), (0.1, 0.7), (0.2, -0.25)]
    lines = [head, *(",".join(map(str, row[::order])) for row in rows)]
    (tmp_path / "record.csv").write_text("\n".join(lines))
    time, values = read_record(tmp_path / "record.csv", "acceleration")
    np.testing.assert_allclose(time, [0.0, 0.1, 0.2])
    np.testing.assert_allclose(values, np.array([0.5, 0.7, -0.25]) * (9.80665 if "g)" in head else 1.0))


READ = {
    ("Pa", 453e3): "0.453 MPa; 0.453 N/mm2; 0.453 N/mm^2; 0.453 N/mm**2; 0.453 N/mm²",
    ("Pa/m", 82e9): "82 N/mm3; 82 MPa/mm",
    ("m", 8e-3): "8 mm; 8mm;   8   mm ; +8 mm",
    ("m", -8e-3): "-8 mm",
    ("m", 0.5): ".5 m",
    ("m", 5.0): "5. m",
    ("m", 1.0): "1e3 mm; 1E3 mm",
    ("m", 1e-3): "1e-3 m",
    ("Pa", 9e9): "9e9 Pa; 9E3MPa",
    ("N", 6000.0): "6 kN",
    ("N/m", 10.0): "10 N/m; 0.01 N/mm; 10 J/m2; 10 J/m^2; 0.01 kJ/m²",
    ("1", 0.3): "30 %; 30%",
    ("kg/m**3", 2000.0): "2000 kg/m3; 2 t/m3; 2 g/cm3",
    ("m", 0.3048): "1 ft",
    ("m", 0.0254): "1 inch",
    ("Pa", 0.45359237 * 9.80665 / 0.0254**2): "1 psi",
    ("1", 0.75): "0.75",  # no unit: SI
    ("Pa", 1e6): "1e6",
    ("m", 6.0): "6",
}


@pytest.mark.parametrize(("text", "unit", "value"), [(t, *of) for of, texts in READ.items() for t in texts.split("; ")])
def test_value_in_si(text: str, unit: str, value: float):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-14, abs=0)


GARBAGE = (  # a unit is no number: not 1 mm; a decimal comma must not become 85 mm
    "| |abc|mm|m|8 banana|8,5 mm|1,000 mm|8 mm 3|8 3 mm|3 m + 2 mm|3 + 2 mm|8 mm # about|--8 mm|8 mm;|1 m = 1|"
    "__import__('os')|lambda: 1|()|±|8 e3 mm|\N{SNOWMAN}"
)


@pytest.mark.parametrize("text", GARBAGE.split("|"))
def test_garbage_is_refused_with_an_example(text: str):
    with pytest.raises(ValueError, match=r"expected .*'8 mm'"):
        to_si(text, "m")


INFINITE = (math.nan, math.inf, -math.inf, "nan", "inf", "-inf", "infinity", "1e999", "1e999 m", 10**400, -(10**400))
OTHER_TYPES = (True, False, None, [1.0], {"value": 1.0}, b"8 mm", 1j)


@pytest.mark.parametrize(
    ("value", "words"),
    [(value, "finite") for value in INFINITE]
    + [(value, "expected a number in m") for value in OTHER_TYPES]
    + [(value, "must be at most 1e") for value in (1e300, -1e31, "1e40 MPa", 10**40)],
)
def test_what_is_no_number_is_refused(value: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        to_si(value, "Pa" if words.startswith("must") else "m")


@given(st.floats(min_value=-1e30, max_value=1e30))
def test_numbers_are_taken_as_they_are(value: float):
    assert to_si(value, "Pa") == value
    assert to_si(repr(value), "Pa") == value
