"""Surveys in files: named columns with units, two visits, cracks and levels for a back-analysis."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from damagepred.errors import InputError
from damagepred.uq.observations import Observations
from tests.scene.test_input_tables import scene

X = np.arange(5.0)
LEVELS = np.array([0.0, -1.0, -4.1, -11.8, -19.9])
ROWS = {"Chainage (mm)": 1e3 * X, "level [m]": 1e-3 * LEVELS, "point": list("ABCDE")}


@pytest.mark.parametrize("form", ["names", "order of columns", "settlement", "workbook", "two visits", "tail"])
def test_one_profile_in_many_forms(tmp_path: Path, form: str) -> None:
    frame = pd.DataFrame(ROWS)
    if form == "order of columns":
        frame = frame[["point", "level [m]", "Chainage (mm)"]]
    if form == "settlement":
        frame = frame.rename(columns={"level [m]": "Settlement [m]"}).assign(**{"Settlement [m]": -1e-3 * LEVELS})
    if form == "tail":
        frame = frame.rename(columns={"level [m]": "Reduced level, m", "Chainage (mm)": "x mm"})
    if form == "two visits":
        before = frame.assign(date="2024-03-01", **{"level [m]": 57.3 + 0.01 * X})
        later = frame.assign(date="2026-03-01", **{"level [m]": 57.3 + 0.01 * X + 1e-3 * LEVELS})
        frame = pd.concat([later, before.iloc[::-1]])
    text = frame.to_csv(index=False, sep=";" if form == "tail" else ",")
    if form == "workbook":
        pytest.importorskip("openpyxl")
        frame.assign(date=pd.Timestamp("2026-03-01")).to_excel(tmp_path / "levels.xlsx", index=False)
        (tmp_path / "w.toml").write_text(
            '[wall]\nlength = 4\nheight = 0.6\n[movement]\nshape = "table"\ntable = "levels.xlsx"\n'
        )
        from damagepred import Scene

        found = Scene.from_toml(tmp_path / "w.toml").movement
    else:
        found = scene(tmp_path, text).movement
    np.testing.assert_allclose(found.profile(X, 4.0), 1e-3 * LEVELS, rtol=1e-9, atol=1e-12)


def test_the_error_of_a_profile_is_sampled(tmp_path: Path) -> None:
    text = pd.DataFrame(ROWS).assign(**{"error (mm)": 0.5}).to_csv(index=False)
    assert scene(tmp_path, text).movement.survey_error == pytest.approx(5e-4)
    assert scene(tmp_path, text, "survey_error = 0.001").movement.survey_error == 1e-3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "x (m),level (mm),colour\n0,0,1\n4,1,2\n",
            r"levels.csv, line 1, column 3: 'colour' is unknown; the columns may be x",
        ),
        ("# east\nx,position,level\n0,0,0\n", "line 2, column 2: 'position' and 'x' both mean x"),
        ("level (mm),point\n1,A\n", r"line 1: has no column x .*it has level \(mm\), point"),
        ("x (m),level (mm),settlement (mm)\n0,0,0\n4,1,1\n", "needs a column level, or a column settlement"),
        ("x,level (mm),date\n0,0,1 May\n4,1,2\n", "line 2, date = '1 May': must be a date such as"),
        (
            "x,level (mm),date\n0,0,2024-01-01\n0,1,2025-01-01\n0,1,2026-01-01\n",
            "column date: has 3 visits.*keep the rows",
        ),
        ("x,level (mm),date\n0,0,2024-01-01\n1,1,2025-01-01\n", "line 3: the visit of 2024-01-01 has no point at 1 m"),
        ("x (m),level (mm),error (mm)\n0,0,1\n4,1,2\n", "one error for all levels"),
        ("x (m),error (mm)\n0,0\n4,1\n", "has no column level"),
        ("x (s),level (mm)\n0,0\n4,1\n", r"column 'x \(s\)': has the wrong kind of unit"),
        ("x (m),level (mm)\n0,0\n4,1.2.3\n", r"line 3, level = '1\.2\.3'"),
    ],
)
def test_profiles_that_are_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        scene(tmp_path, text)


def observations(folder: Path, toml: str = "", **files: str) -> Observations:
    for name, text in files.items():
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    (folder / "observations.toml").write_text(toml, encoding="utf-8")
    return Observations.from_toml(folder / "observations.toml")


CRACKS = (
    "Position (mm);y (m);crack width (mm);direction;point\n960;0,1;2,5;horizontal;A\n500;0,1;0;;B\n1200;0,3;0,4;;C\n"
)


def test_cracks_of_a_file_are_those_of_tables(tmp_path: Path) -> None:
    toml = '[[crack]]\nfile = "cracks.csv"\nwithin = "0.25 m"\nerror = "0.3 mm"\n[[crack]]\nwidth = "2.5 mm"\n'
    found = observations(tmp_path, toml, cracks=CRACKS).crack
    assert len(found) == 4
    assert [c.width for c in found] == pytest.approx([2.5e-3, None, 4e-4, 2.5e-3])
    assert [c.none for c in found] == [False, True, False, False]
    assert [c.place for c in found] == [(0.96, 0.1), (0.5, 0.1), (1.2, 0.3), None]
    assert [c.direction for c in found] == ["horizontal", None, None, None]
    assert {c.within for c in found[:3]} == {0.25}
    assert found[0].error == pytest.approx(3e-4)
    assert Observations.from_toml(tmp_path / "cracks.csv").crack[2].width == pytest.approx(4e-4)


def test_levels_count_from_the_first_point_or_between_visits(tmp_path: Path) -> None:
    one = "x,level (mm)\n1,57300\n2,57302\n4,57295\n"
    found = observations(tmp_path, '[[level]]\nfile = "levels.csv"\ny = "150 mm"\nerror = "1 mm"\n', levels=one).level
    assert [(v.x, v.y, v.to_x, v.to_y) for v in found] == [(1.0, 0.15, 2.0, 0.15), (1.0, 0.15, 4.0, 0.15)]
    np.testing.assert_allclose([v.difference for v in found], [2e-3, -5e-3], atol=1e-12)
    np.testing.assert_allclose([v.error for v in found], np.sqrt(2.0) * 1e-3)
    two = "date,x,y,settlement (mm),error (mm)\n" + "".join(
        f"{day},{x},0.2,{s},{e}\n"
        for day, e, values in (("2024-01-01", 0.3, (5, 7, 9)), ("2026-01-01", 0.4, (6, 7, 19)))
        for x, s in zip((0, 1, 3), values)
    )
    (tmp_path / "visits.csv").write_text(two)
    found = Observations.from_toml(tmp_path / "visits.csv").level
    np.testing.assert_allclose([v.difference for v in found], [1e-3, -9e-3], atol=1e-12)
    np.testing.assert_allclose([v.error for v in found], np.hypot(0.5e-3, 0.5e-3))


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        (
            "crack",
            "x,y,width (mm),colour\n1,1,2,3\n",
            r"f\.csv, line 1, column 4: 'colour' is unknown; .*wider_than \[m\]",
        ),
        ("crack", "x,y,width (mm)\n1,1,-2\n", r"f\.csv, line 2: width = -0\.002: must be greater than 0"),
        ("crack", "x,y,width (mm)\n1,1,wide\n", r"line 2, width = 'wide'"),
        ("crack", "x,y,width (mm),direction\n1,1,2,up\n", r"line 2: direction = 'up': must be 'horizontal'"),
        ("level", "x,level\n1,2\n", "needs two points or more"),
        ("level", "x,y,level\n0,0,0\n1,20000,0.1\n", r"line 3: to_y = 20000"),
        ("slope", "value,error\n-1,0\n", r"line 2: value = -1"),
    ],
)
def test_surveys_that_are_refused(tmp_path: Path, name: str, text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        observations(tmp_path, f'[[{name}]]\nfile = "f.csv"\n', f=text)


VISITS = "date;x (m);level (mm)\n" + "".join(
    f"{day};{x};{value}\n"
    for day, values in (("1.3.2022", "0 0 0"), ("01.03.2023", "0 -2 -4"), ("2024-03-01", "-1 -4 -9"))
    for x, value in zip("024", values.split())
)


def test_levels_of_many_visits_are_series_since_the_first(tmp_path: Path) -> None:
    """Each later visit gives the change since the first, with both dates; two visits do where others have dates."""
    survey = observations(tmp_path, '[[level]]\nfile = "levels.csv"\ny = "0.3 m"\n', levels=VISITS)
    np.testing.assert_allclose([v.difference for v in survey.level], [-2e-3, -4e-3, -3e-3, -8e-3], atol=1e-12)
    assert [str(v.date) for v in survey.level] == ["2023-03-01"] * 2 + ["2024-03-01"] * 2
    assert {str(v.since) for v in survey.level} == {"2022-03-01"}
    assert [len(readings) for _, readings in survey.series] == [2, 2]
    two = VISITS.replace("1.3.2022;", "x").replace("x0;0\nx2;0\nx4;0\n", "")
    alone = observations(tmp_path, '[[level]]\nfile = "levels.csv"\n', levels=two)
    assert {v.date for v in alone.level} == {None}
    crack = '[[crack]]\nwidth = "1 mm"\ndate = 2024-03-01\n'
    dated = observations(tmp_path, crack + '[[level]]\nfile = "levels.csv"\n', levels=two)
    assert {(str(v.since), str(v.date)) for v in dated.level} == {("2023-03-01", "2024-03-01")}
    with pytest.raises(InputError, match="level 1: has no date, but other"):
        observations(tmp_path, crack + '[[level]]\nfile = "levels.csv"\n', levels="x,level (mm)\n0,0\n1,1\n")


def test_a_monitor_of_a_file_is_its_table(tmp_path: Path) -> None:
    place = 'x = "1 m"\ny = "0.5 m"\nerror = "0.1 mm"\n'
    rows = 'date = [2022-01-01, 2023-01-01, 2024-01-01]\nchange = [0, "0.2 mm", "0.5 mm"]\n'
    by_hand = observations(tmp_path, "[[monitor]]\n" + place + rows).cracks
    text = "Date,Change [mm],Remark\n2022-01-01,0,\n2023-01-01,0.2,\n01.01.2024,0.5,after rain\n"
    assert observations(tmp_path, '[[monitor]]\nfile = "m.csv"\n' + place, m=text).cracks == by_hand
    for wrong, said in (
        (text.replace("Date", "x"), "'x' is unknown; the columns may be width .m., change .m., date"),
        (text.replace("01.01.2024", "1/1/2024"), "line 4, Date = '1/1/2024': must be a date such as 2026-11-28 or"),
        (text.replace("01.01.2024", "32.1.2024"), "line 4, Date = '32.1.2024': is no date .day is out of range"),
        (text.replace(" [mm]", ""), "monitor 1: change = 0.5: must be at most 0.3 m"),
        (text.replace("2023", "2021"), "monitor 1: 2021-01-01 follows 2022-01-01"),
    ):
        with pytest.raises(InputError, match=said):
            observations(tmp_path, '[[monitor]]\nfile = "m.csv"\n' + place, m=wrong)


def test_millimetres_without_their_unit_are_refused(tmp_path: Path) -> None:
    for table, said in (
        ("[[crack]]\nwidth = 1.2\n", "width = 1.2: must be at most 0.3 m"),
        ("[[crack]]\nwider_than = 0.5\n", "wider_than = 0.5: must be at most 0.3 m"),
        ("[[level]]\nx = 0\ny = 0\nto_x = 1\nto_y = 0\ndifference = -5\n", "difference = -5.*: must be at least -1 m"),
        ("[[window]]\nopening = 1\nwidth_change = -3\n", "width_change = -3.*: must be at least -0.3 m"),
    ):
        with pytest.raises(InputError, match=said):
            observations(tmp_path, table)
