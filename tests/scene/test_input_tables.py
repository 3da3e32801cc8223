"""Profiles, histories and records of a scene file are compared with the wall and the run they describe."""

from pathlib import Path

import numpy as np
import pytest

import damagepred
from damagepred import BaseMotion, Dynamics, InputError, Scene, Study

LEVELS = "x (m),level (mm)\n0,0\n1,-1.0\n2,-4.1\n3,-11.8\n4,-19.9\n"
WALL = "[wall]\nlength = 4\nheight = 0.6\nblock_length = 0.5\nblock_height = 0.15\n"


def scene(folder: Path, text: str, keys: str = "", table: str = "movement") -> Scene:
    """Read the scene of a wall of 4 m whose profile is a file."""
    (folder / "levels.csv").write_text(text, encoding="utf-8")
    head = f'[movement]\nshape = "{"table" if table == "movement" else "mound"}"\n{keys}\n'
    if table == "mound":
        head += ("" if "[mound]" in keys else "[mound]\n") + 'shape = "table"\n'
    (folder / "wall.toml").write_text(f'{WALL}{head}table = "levels.csv"\n', encoding="utf-8")
    return Scene.from_toml(folder / "wall.toml")


def test_the_same_levels_in_other_units_and_beside_a_study(tmp_path: Path) -> None:
    one = scene(tmp_path, LEVELS).movement
    for text in (
        "x (mm);level (m)\n0;0\n1000;-0,001\n2000;-0,0041\n3000;-0,0118\n4000;-0,0199\n",
        "x (%),level (mm)\n0,0\n25,-1.0\n50,-4.1\n75,-11.8\n100,-19.9\n",
        "x,level (mm)\n0.002,0\n1,-1.0\n2,-4.1\n3,-11.8\n3.999,-19.9\n",
    ):
        other = scene(tmp_path, text).movement
        np.testing.assert_allclose(other.table, one.table, rtol=1e-12, atol=1e-15)
        assert other.central_deflection == pytest.approx(one.central_deflection)
    reduced = scene(tmp_path, "x (m),level (m)\n0,99.5\n2,99.52\n4,99.5\n").movement
    np.testing.assert_allclose(reduced.profile(np.array([0.0, 2.0, 4.0]), 4.0), [0, 0.02, 0], atol=1e-12)
    text = (tmp_path / "wall.toml").read_text().replace("[", "[scene.")
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    (tmp_path / "levels.csv").write_text(LEVELS)
    assert Study.from_toml(tmp_path / "study.toml").settings.scene.movement == one


FORM = LEVELS.replace("level (mm)", "level")


@pytest.mark.parametrize(
    ("text", "keys", "said"),
    [
        (LEVELS, 'kind = "dishing"', r"middle lies \+5\.85 mm.*kind = 'dishing' contradicts"),
        (LEVELS, "central_deflection = 0.008", r"movement\.central_deflection = 0\.008 contradicts"),
        (FORM, "", "form alone.*give kind and central_deflection"),
        (FORM, 'kind = "doming"', "give central_deflection"),
        ("0.5,0\n2,1\n3.5,0\n", "", r"goes from 0\.5 to 3\.5 m, the wall from 0 to 4 m"),
        ("-3,0\n2,1\n8,0\n", "", "goes from -3 to 8 m"),
        ("-3,0\n2,1\n3,0\n", 'table_ends = "cut"', "goes from -3 to 3 m"),
        ("5,0\n6,1\n8,0\n", 'table_ends = "level"', "goes from 5 to 8 m"),
        ("0,0\n0.5,1\n1,0\n", 'kind = "doming"\ncentral_deflection = 0.01', "goes from 0 to 1 m"),
        ("0,0\n2,1\n1,1\n4,0\n", "", "line 3: positions must rise"),
        ("1,2\n", "", "at least two points"),
        ("0,0,0\n2,1,0\n4,0,0\n", "", "its second column has no unit"),
        ("x (m),level (kPa)\n0,0\n2,1\n4,0\n", "", "wrong kind of unit"),
        ("0,0\n2,a\n4,0\n", "", "line 2"),
    ],
)
def test_profiles_that_contradict_the_wall_or_the_scene(tmp_path: Path, text: str, keys: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        scene(tmp_path, text, keys)


def test_the_ends_of_a_survey_are_cut_or_continued_as_a_key_asks(tmp_path: Path) -> None:
    short = "x (m),level (mm)\n1,0\n2,6\n3,0\n"
    at = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    level = scene(tmp_path, short, 'table_ends = "level"').movement
    np.testing.assert_allclose(level.profile(at, 4.0), [0, 0, 6e-3, 0, 0], atol=1e-15)
    straight = scene(tmp_path, short, 'table_ends = "extend"').movement
    assert straight.central_deflection == pytest.approx(12e-3)
    np.testing.assert_allclose(straight.profile(at, 4.0), [-6e-3, 0, 6e-3, 0, -6e-3], atol=1e-15)
    line = "x (m),level (mm)\n" + "".join(f"{x},{-2.0 * abs(x - 2)}\n" for x in range(-3, 9))
    cut = scene(tmp_path, line, 'table_ends = "cut"').movement
    np.testing.assert_allclose(cut.profile(at, 4.0), [-4e-3, -2e-3, 0, -2e-3, -4e-3], atol=1e-15)


@pytest.mark.parametrize("table", ["movement", "mound"])
@pytest.mark.parametrize(("head", "refused"), [("x (m)", True), ("x (mm)", True), ("x", True), ("x (1)", False)])
def test_a_profile_in_metres_keeps_the_length_of_the_wall(tmp_path: Path, table: str, head: str, refused: bool) -> None:
    """Another length would stretch it."""
    unit = {"x (mm)": 1e3, "x (1)": 0.25}.get(head, 1.0)
    (tmp_path / "levels.csv").write_text(f"{head},level (mm)\n0,0\n{2 * unit},-8\n{4 * unit},0\n")
    shape = "table" if table == "movement" else "mound"
    mound = '[scene.mound]\nshape = "table"\ntable = "levels.csv"\n' if table == "mound" else ""
    (tmp_path / "study.toml").write_text(
        "[scene.wall]\nlength = 4.0\nheight = 0.9\n"
        f'[scene.movement]\nshape = "{shape}"\n'
        + ('table = "levels.csv"\n' if table == "movement" else "")
        + mound
        + '[variables."wall.length"]\ndistribution = "uniform"\nlower = 3.9\nupper = 4.1\n'
    )
    if refused:
        with pytest.raises(InputError, match=rf"must stay as it is, because {table}.table = 'levels.csv' has"):
            Study.from_toml(tmp_path / "study.toml")
    else:
        assert Study.from_toml(tmp_path / "study.toml").settings.scene.in_metres == ()


def test_the_movement_of_a_mound_has_sign_and_size(tmp_path: Path) -> None:
    text = "x (m),movement (mm)\n0,-30\n1,-12\n4,2\n"
    found = scene(tmp_path, text, table="mound")
    assert (found.movement.kind, found.mound.surface_movement) == ("settle", pytest.approx(0.03))
    x = np.array([0.0, 1.0, 4.0])
    np.testing.assert_allclose(found.mound.profile(x, 4.0, "dishing"), [-0.03, -0.012, 0.002], rtol=1e-12)
    up = scene(tmp_path, text.replace("-", ""), table="mound")
    np.testing.assert_allclose(up.mound.profile(x, 4.0, up.movement.kind), [0.03, 0.012, 0.002], rtol=1e-12)
    sized = 'kind = "dishing"\n[mound]\nsurface_movement = 0.03'
    for wrong, keys, said in (
        (text, 'kind = "doming"', "largest movement is -30 mm.*contradicts"),
        (text, sized.replace("3", "4"), "mound.surface_movement = 0.04 contradicts"),
        (text.replace(" (mm)", ""), 'kind = "dishing"', "give surface_movement"),
        ("0,-30\n4,2\n", sized, "fractions of surface_movement"),
        ("0,1\n3,0\n", "", "goes from 0 to 3 m"),
    ):
        with pytest.raises(InputError, match=said):
            scene(tmp_path, wrong, keys, table="mound")


RUN = """wall = { length = 0.48, height = 0.15 }
movement = { central_deflection = 0, increments = 1 }
[dynamics]
outputs = 4
"""


def dynamics(folder: Path, record: str, keys: str = "", base: str = "") -> Dynamics:
    """Read the run of a wall that is shaken by a record beside its file."""
    (folder / "q.csv").write_text(record)
    (folder / "wall.toml").write_text(f'{RUN}{keys}\n[[dynamics.base]]\nfile = "q.csv"\n{base}\n')
    found = Scene.from_toml(folder / "wall.toml").dynamics
    return found


LATE = "t (s),a (m/s2)\n0,0\n5,0\n6,1\n8,-1\n9,0\n12,0\n"


def test_a_run_covers_its_records(tmp_path: Path) -> None:
    late = dynamics(tmp_path, LATE)
    assert (late.run_duration, late.loading_end) == (12.0, 9.0)
    assert dynamics(tmp_path, "t,a\n0,0\n0.2,1\n0.4,0\n").run_duration == 2.0
    assert dynamics(tmp_path, LATE, base="start = 3").run_duration == 15.0
    assert dynamics(tmp_path, LATE, keys="movement_time = 20").run_duration == 20.0
    assert Dynamics(base=(BaseMotion(file=str(tmp_path / "q.csv")),)).run_duration == 12.0
    pulse = BaseMotion(kind="half_sine", acceleration=1.0, duration=0.5, start=4.0)
    assert Dynamics(base=(pulse,)).run_duration == 4.5
    for text in ("t (ms),a (g)\n0,0\n200,0.1\n400,0\n", "t;a (cm/s2)\n0;0\n0,2;98,0665\n0,4;0\n"):
        [motion] = dynamics(tmp_path, text).base
        assert motion.file is None
        np.testing.assert_allclose([motion.time, motion.values], [[0, 0.2, 0.4], [0, 0.980665, 0]])


@pytest.mark.parametrize(
    ("record", "keys", "base", "said"),
    [
        (LATE, "duration = 2", "", "base 1: shakes from 5 to 9 s, and the run ends at 2 s"),
        (LATE, "duration = 6", "start = 1", "shakes from 6 to 10 s"),
        ("0,0\n1,0\n", "", "", "never moves"),
        ("0,0.3\n1,0.3\n", "", 'quantity = "displacement"', "never moves"),
        ("0,0.3\n1,0.3\n", "", 'baseline = "velocity"', "never moves"),
        (LATE, "", "scale = 0", "never moves"),
        (LATE, "", 'quantity = "velocity"', "wrong kind of unit.*quantity = 'velocity'"),
        (LATE.replace("m/s2", "g"), "", "scale = 9.81", r"'a \(g\)'; scale = 9\.81 converts it again"),
        ("0,0\n1,1\n1,0\n", "", "", "rise from line to line"),
        ("-1,0\n1,1\n2,0\n", "", "", "0 or later"),
        ("t,ax,ay\n0,0,0\n1,1,1\n", "", "", "3 columns; 2 are expected"),
        ("t,a\n0,0\n1,x\n", "", "", "line 3"),
        ("t;a\n0;0\n1;0,5\n2;1.5\n", "", "", "decimal points"),
    ],
)
def test_records_that_do_not_fit_the_run(tmp_path: Path, record: str, keys: str, base: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        dynamics(tmp_path, record, keys, base)


@pytest.mark.thorough
def test_a_run_that_ends_before_the_shaking_says_so_and_rest_waits_for_it(tmp_path: Path) -> None:
    shaken = "0,0\n0.02,0\n0.03,1\n0.05,-1\n0.06,0\n"
    (tmp_path / "q.csv").write_text(shaken)
    (tmp_path / "wall.toml").write_text(
        f'{RUN}duration = 0.04\nstop_at_rest = true\ndamping = "viscous"\n[[dynamics.base]]\nfile = "q.csv"\n'
    )
    from damagepred.archive.cautions import wall_cautions

    ds = damagepred.solve(Scene.from_toml(tmp_path / "wall.toml"))
    assert ds["time"].values[-1] == pytest.approx(0.04), "still before it is shaken, it does not stop"
    assert np.abs(ds["base_displacement_x"].values).max() > 0
    assert any("from 0.04 to 0.06 s" in said for said in wall_cautions(ds))


@pytest.mark.parametrize(("roof", "newtons"), [("3 kN/m", 27e3), ("3 N/mm", 27e3), ("27 kN", 27e3), (27e3, 27e3)])
def test_a_roof_is_given_in_all_or_per_length_of_the_wall(roof: object, newtons: float) -> None:
    assert Scene.from_dict({"wall": {"length": "9 m"}, "loads": {"roof": roof}}).loads.roof == pytest.approx(newtons)
