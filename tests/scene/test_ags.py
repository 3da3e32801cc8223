"""Soil logs in AGS 4: the same surface movement as the layers in TOML, and malformed files are refused by place."""

from pathlib import Path

import pytest

from damagepred.errors import InputError
from damagepred.scene import Scene

AGS = """"GROUP","PROJ"
"HEADING","PROJ_ID","PROJ_NAME"
"UNIT","",""
"TYPE","ID","X"
"DATA","1","A ""street"", 3 houses"

"GROUP","GEOL"
"HEADING","LOCA_ID","GEOL_TOP","GEOL_BASE","GEOL_DESC","GEOL_LEG","GEOL_GEOL"
"UNIT","","m","m","","",""
"TYPE","ID","2DP","2DP","X","PA","PA"
"DATA","BH1","0.40","1.00","Firm brown CLAY, fissured","201","LC"
"DATA","BH1","0.00","0.40","TOPSOIL","101","TS"
"DATA","BH1","1.00","1.60","Stiff brown CLAY","201","LC"
"DATA","BH1","1.60","4.60","Stiff grey CLAY","201","GC"
"DATA","BH2","0.00","6.00","SAND","301","SA"

"GROUP","LLPL"
"HEADING","LOCA_ID","SAMP_TOP","SPEC_DPTH","LLPL_LL","LLPL_PL","LLPL_PI"
"UNIT","","m","m","%","%","%"
"TYPE","ID","2DP","2DP","0DP","XN","0DP"
"DATA","BH1","0.50","0.60","70","25","45"
"DATA","BH1","1.20","","65","30",""
"DATA","BH1","2.00","2.10","60","28","32"
"DATA","BH1","3.00","3.10","58","30","28"
"DATA","BH2","1.00","1.00","","NP",""
"""
INDICES = "code,shrink_swell_index [%],name\nTS,1,topsoil\nLC,4,clay\nGC,3,\n301,0,\n"
LAYERS = [
    {"name": "topsoil", "thickness": 0.4, "shrink_swell_index": 0.01},
    {"name": "clay", "thickness": 1.2, "shrink_swell_index": 0.04},
    {"name": "GC", "thickness": 3.0, "shrink_swell_index": 0.03},
]
WALL = """[wall]
length = 4
height = 0.6
[movement]
shape = "mound"
[mound]
suction_depth = "3 m"
"""
ENTRY = '[[soil_layer]]\nfile = "site.ags"\nindices = "indices.csv"\n'


def read(folder: Path, ags: str = AGS, indices: str = INDICES, keys: str = 'borehole = "BH1"') -> Scene:
    (folder / "site.ags").write_text(ags, encoding="utf-8", newline="\r\n")
    (folder / "indices.csv").write_text(indices, encoding="utf-8")
    (folder / "wall.toml").write_text(f"{WALL}{ENTRY}{keys}\n")
    return Scene.from_toml(folder / "wall.toml")


def in_toml(layers: list[dict]) -> Scene:
    tables = {"wall": {"length": 4, "height": 0.6}, "movement": {"shape": "mound"}, "mound": {"suction_depth": 3.0}}
    return Scene.from_dict({**tables, "soil_layer": layers})


def test_a_log_is_the_same_as_its_layers_in_toml(tmp_path: Path) -> None:
    found, expected = read(tmp_path), in_toml(LAYERS)
    assert [layer.name for layer in found.soil_layer] == ["topsoil", "clay", "GC"]
    assert [layer.thickness for layer in found.soil_layer] == pytest.approx([0.4, 1.2, 3.0])
    assert found.mound.surface_movement == pytest.approx(expected.mound.surface_movement, rel=1e-12)
    # by hand: du (1 - z/H) I_ss, from 1.5 m on with alpha = 2 - z/5
    strain, steps = lambda z: 0.01 if z < 0.4 else 0.04 if z < 1.6 else 0.03, 30000
    depths = [(k + 0.5) * 3.0 / steps for k in range(steps)]
    by_hand = sum(1.2 * (1 - z / 3) * strain(z) * (1.0 if z < 1.5 else 2 - z / 5) for z in depths) * 3.0 / steps
    assert found.mound.surface_movement == pytest.approx(by_hand, rel=1e-4)
    assert Scene.from_dict(found.to_dict()) == found, "archives have the layers"
    assert read(tmp_path, keys='borehole = "BH2"').soil_layer[0].name is None, "a number is no name"


def test_indices_by_plasticity(tmp_path: Path) -> None:
    """A local relation, linear between the points; a code goes before it."""
    relation = "code;plasticity_index [%];shrink_swell_index\nTS;;1 %\n;0;0\n;20;2 %\n;45;4.5 %\n"
    found = read(tmp_path, indices=relation).soil_layer
    # of the layers: code, 45, 35 = 65 - 30, mean of 32 and 28
    assert [layer.shrink_swell_index for layer in found] == pytest.approx([0.01, 0.045, 0.035, 0.03])
    assert [layer.name for layer in found] == ["TS", "LC", "LC_2", "GC"]
    [sand] = read(tmp_path, indices=relation, keys='borehole = "BH2"').soil_layer
    assert sand.shrink_swell_index == 0.0


@pytest.mark.parametrize(
    ("ags", "indices", "keys", "said"),
    [
        (AGS, INDICES, "", r"borehole is missing; .*site\.ags has BH1, BH2"),
        (AGS, INDICES, 'borehole = "BH3"', r"borehole = 'BH3': is not in .*has BH1, BH2.*Did you mean"),
        (AGS, INDICES, 'borehole = "BH1"\nthickness = 1', "thickness: is not read with file"),
        (AGS, INDICES, "borehole = 1", "borehole = 1: must be a text"),
        (AGS, INDICES.replace("GC,3,\n", ""), None, r"line 14: .*indices\.csv has no index for the layer 1\.6 to 4\.6 "
         r"m \(Stiff grey CLAY\), code GC or 201, plasticity index 30 %"),
        (AGS.replace("LLPL", "OTHR"), "code,iss\nTS,0\nLC,0\n", None, "LLPL has no plasticity index there"),
        (AGS, INDICES.replace("LC,4", "LC,400"), None, r"indices\.csv, line 3: shrink_swell_index = 4"),
        (AGS, INDICES + "TS,2,\n", None, r"indices\.csv, line 6, code = 'TS': is given twice"),
        (AGS, INDICES + ",2,\n", None, "line 6: give a code or a plasticity_index"),
        (AGS, "code,colour\nTS,1\n", None, r"line 1, column 2: 'colour' is unknown; the columns may be code"),
        (AGS, "pi,iss\n0.3,0\n0.2,1 %\n", None, "two values or more that rise"),
        (AGS.replace('"1.60","4.60"', '"1.70","4.60"'), INDICES, None, r"line 14: .*GEOL_TOP = 1\.7 to .* from 1\.6 m"),
        (AGS.replace('"0.00","0.40","T', '"0.10","0.40","T'), INDICES, None, "line 12: .* from 0 m, the surface"),
        (AGS.replace('"4.60"', '"deep"'), INDICES, None, r"line 14, GEOL_BASE = 'deep' \(UNIT 'm'\): is no number"),
        (AGS.replace('"4.60"', '""'), INDICES, None, "line 14, GEOL_BASE = '' .*: is empty"),
        (AGS.replace('"UNIT","","m","m",""', '"UNIT","","kPa","m",""'), INDICES, None, "GEOL_TOP = .*wrong kind"),
        (AGS.replace('"201","LC"\n', '"201"\n', 1), INDICES, None, "line 11: has 5 cells after DATA, .*GEOL 6"),
        (AGS.replace('fissured"', "fissured"), INDICES, None, "line 11: is no row of a table"),
        (AGS.replace('"DATA","BH2"', '"DATEN","BH2"'), INDICES, None, "line 15, column 1 = 'DATEN'"),
        (AGS.replace("GEOL_BASE", "BASE"), INDICES, None, "GEOL has no heading GEOL_BASE; it has LOCA_ID"),
        (AGS.replace('"GEOL"\n', '"GEOX"\n', 1), INDICES, None, "has no group GEOL.*it has PROJ, GEOX, LLPL"),
        (AGS.replace('"LLPL"\n', '"GEOL"\n'), INDICES, None, "line 17: the file has group GEOL twice"),
        ('"**GEOL"\n"*HOLE_ID","*GEOL_TOP"\n', INDICES, None, "line 1: is AGS 3"),
    ],
)  # fmt: skip
def test_logs_that_are_refused(tmp_path: Path, ags: str, indices: str, keys: str | None, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(tmp_path, ags, indices, 'borehole = "BH1"' if keys is None else keys)


def test_a_log_without_indices(tmp_path: Path) -> None:
    (tmp_path / "site.ags").write_text(AGS)
    (tmp_path / "wall.toml").write_text(WALL + '[[soil_layer]]\nfile = "site.ags"\nborehole = "BH2"\n')
    with pytest.raises(InputError, match=r"indices: is missing; .* has no shrink-swell index"):
        Scene.from_toml(tmp_path / "wall.toml")


def test_each_house_of_a_portfolio_has_its_borehole(tmp_path: Path) -> None:
    from damagepred.analyses.portfolio import read_houses

    read(tmp_path)
    study = (WALL + ENTRY + 'borehole = "BH1"\n').replace("[[s", "[[scene.s").replace("[wall", "[scene.wall")
    study = study.replace("[movement", "[scene.movement").replace("[mound", "[scene.mound")
    (tmp_path / "study.toml").write_text(study)
    (tmp_path / "houses.csv").write_text("name,soil_layer.1.borehole\nA,BH1\nB,BH2\n")
    _, houses = read_houses(tmp_path / "houses.csv", tmp_path / "study.toml", "site", None)
    assert [len(house.settings.scene.soil_layer) for house in houses] == [3, 1]
