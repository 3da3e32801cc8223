"""Records in the format of PEER: times from DT, values in SI, and what is malformed is refused."""

from pathlib import Path

import numpy as np
import pytest

from damagepred.errors import InputError
from damagepred.scene import BaseMotion
from damagepred.scene.input_tables import read_record

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
